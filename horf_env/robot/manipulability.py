"""Yoshikawa's manipulability of an arm and its gradient, from the arm's Jacobian alone."""

from __future__ import annotations

import numba
import numpy as np

from horf_env.types import FloatArray

_SINGULAR = np.finfo(float).tiny  # a determinant this small is zero


def manipulability(J: FloatArray) -> float:
    """Measure sqrt(det(J J^T)); it mixes m and rad.

    Args:
        J: Jacobian of a serial arm with revolute joints, (linear; angular), shape (6, n).
    """
    return float(np.sqrt(max(np.linalg.det(J @ J.T), 0.0)))


def manipulability_gradient(J: FloatArray) -> FloatArray:
    """Gradient of the manipulability m with respect to the joints (J_m in the paper's C).

    dm/dq_i = m trace((J J^T)^-1 (dJ/dq_i) J^T). The Hessian dJ/dq has a closed form, used here
    because Pinocchio's Python binding returns its Hessians with the axes of the array mixed up.

    Args:
        J: As in `manipulability`, from the base of the arm to its tip.

    Returns:
        Shape (n,); zeros at a singular configuration, where m has no gradient.
    """
    return np.asarray(compiled_gradient(np.ascontiguousarray(J)))


@numba.njit(cache=True)
def compiled_gradient(J: FloatArray) -> FloatArray:
    """The same for compiled callers; the array has to be contiguous."""
    gram = J @ J.T
    determinant = np.linalg.det(gram)
    if determinant <= _SINGULAR:
        return np.zeros(J.shape[1])
    return np.sqrt(determinant) * _trace_with_hessian(J, np.linalg.solve(gram, J))


@numba.njit(cache=True)
def _trace_with_hessian(J: FloatArray, other: FloatArray) -> FloatArray:
    """Inner products of dJ/dq_i with another matrix, shape (n,).

    A joint turns every axis behind it, and the lever arm of the further of two joints counts: the
    linear part of dJ_j/dq_i is w_min x v_max, the angular part w_i x w_j for i before j.
    """
    n = J.shape[1]
    result = np.zeros(n)
    for i in range(n):
        for j in range(n):
            first, second = min(i, j), max(i, j)
            result[i] += _triple(J, 3, first, 0, second, other, 0, j)
            if i < j:
                result[i] += _triple(J, 3, i, 3, j, other, 3, j)
    return result


@numba.njit(cache=True)
def _triple(
    J: FloatArray, ra: int, a: int, rb: int, b: int, other: FloatArray, rc: int, c: int
) -> float:
    """(a x b) . c for the columns of that name, from these rows on; slices would cost as much."""
    a0, a1, a2 = J[ra, a], J[ra + 1, a], J[ra + 2, a]
    b0, b1, b2 = J[rb, b], J[rb + 1, b], J[rb + 2, b]
    return float(
        (a1 * b2 - a2 * b1) * other[rc, c]
        + (a2 * b0 - a0 * b2) * other[rc + 1, c]
        + (a0 * b1 - a1 * b0) * other[rc + 2, c]
    )
