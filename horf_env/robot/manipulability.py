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
    return np.asarray(_gradient(np.ascontiguousarray(J)))


@numba.njit(cache=True)
def _gradient(J: FloatArray) -> FloatArray:
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
            result[i] += _triple(J[3:, first], J[:3, second], other[:3, j])
            if i < j:
                result[i] += _triple(J[3:, i], J[3:, j], other[3:, j])
    return result


@numba.njit(cache=True)
def _triple(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """(a x b) . c."""
    return float(
        (a[1] * b[2] - a[2] * b[1]) * c[0]
        + (a[2] * b[0] - a[0] * b[2]) * c[1]
        + (a[0] * b[1] - a[1] * b[0]) * c[2]
    )
