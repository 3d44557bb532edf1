"""Yoshikawa's manipulability of an arm and its gradient, from the arm's Jacobian alone."""

from __future__ import annotations

import numpy as np

from horf_env.robot.vectors import cross
from horf_env.types import FloatArray


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
    gram = J @ J.T
    determinant = np.linalg.det(gram)
    if determinant <= np.finfo(float).tiny:
        return np.zeros(J.shape[1])
    pseudo_inverse = np.linalg.solve(gram, J)
    gradient = np.einsum("kj,ijk->i", pseudo_inverse, _hessian(J))
    return np.asarray(np.sqrt(determinant) * gradient)


def _hessian(J: FloatArray) -> FloatArray:
    """dJ[k, j] / dq_i as H[i, j, k], shape (n, n, 6).

    A joint turns every axis behind it, and the lever arm of the further of two joints counts:
    linear part w_min x v_max, angular part w_i x w_j for i before j.
    """
    linear, angular = J[:3].T, J[3:].T
    n = len(angular)
    first, second = np.minimum.outer(range(n), range(n)), np.maximum.outer(range(n), range(n))
    H = np.zeros((n, n, 6))
    H[..., :3] = cross(angular[first], linear[second])
    H[..., 3:] = cross(angular[:, None], angular[None, :]) * np.tri(n, k=-1).T[..., None]
    return H
