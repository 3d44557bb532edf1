"""The paper's QP in fewer unknowns: the EE slack delta = twist - J velocity is eliminated.

Exact, since delta has no bounds here (Haviland bounds it by 10, never reached).
"""

from __future__ import annotations

import numba
import numpy as np

from horf_env.control.active_set import minimiser
from horf_env.control.solvers import ReducedQp
from horf_env.types import FloatArray

Parts = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, float]
"""Arguments of `solved`."""

# Cost of the shared slack of the avoidance rows, linear and quadratic. At 1e3 the slack is used
# only where no velocity keeps all rows (1 of 1980 problems otherwise; 68 with 10).
ROW_SLACK_COST = 1e3
MOST_ROW_SLACK = 1e3  # m/s; a bound that is never reached


@numba.njit(cache=True, error_model="numpy")
def solved(
    rows: FloatArray,
    box: FloatArray,
    J: FloatArray,
    twist: FloatArray,
    weights: FloatArray,
    linear: FloatArray,
    slack_weight: float,
) -> tuple[FloatArray, int, bool]:
    """Solve the whole-body QP.

    Args:
        rows: (G, h) of all avoidance rows, shape (m, 10).
        box: Lower and upper bound of the velocity, shape (2, 9).
        J: Jacobian of the end effector, shape (6, 9).
        twist: That is asked for, shape (6,).
        weights: Diagonal of W, shape (9,).
        linear: Linear term, shape (9,).
        slack_weight: Weight L of the EE slack.

    Returns:
        Velocity (9), EE slack (6) and row slack (1), shape (16,); the number of steps; and whether
        this is a solution.
    """
    P, c, lower, upper = _reduced(box, J, twist, weights, linear, slack_weight)
    x, steps, found = minimiser(P, c, lower, upper, rows)
    return expanded(x, lower, upper, J, twist), steps, found


def reduced_qp(
    rows: FloatArray,
    box: FloatArray,
    J: FloatArray,
    twist: FloatArray,
    weights: FloatArray,
    linear: FloatArray,
    slack_weight: float,
) -> ReducedQp:
    """The problem that `solved` solves, for other solvers."""
    P, c, lower, upper = _reduced(box, J, twist, weights, linear, slack_weight)
    return ReducedQp(P, c, lower, upper, rows)


@numba.njit(cache=True, error_model="numpy")
def _reduced(
    box: FloatArray,
    J: FloatArray,
    twist: FloatArray,
    weights: FloatArray,
    linear: FloatArray,
    slack_weight: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Cost and bounds in x = (velocity (9), row slack (1)); see `solved`.

    P = W + J^T L J and c = linear - J^T L twist for the velocity.

    Returns:
        P (10, 10), c (10,), lower (10,) and upper (10,); see `minimiser`.
    """
    P, c = np.zeros((10, 10)), np.full(10, ROW_SLACK_COST)
    lower, upper = np.zeros(10), np.full(10, MOST_ROW_SLACK)
    for i in range(9):
        c[i], lower[i], upper[i] = linear[i], box[0, i], box[1, i]
        for k in range(6):
            c[i] -= slack_weight * J[k, i] * twist[k]
            for j in range(9):
                P[i, j] += slack_weight * J[k, i] * J[k, j]
        P[i, i] += weights[i]
    P[9, 9] = ROW_SLACK_COST
    return P, c, lower, upper


@numba.njit(cache=True, error_model="numpy")
def expanded(
    x: FloatArray, lower: FloatArray, upper: FloatArray, J: FloatArray, twist: FloatArray
) -> FloatArray:
    """Velocity, EE slack and row slack, shape (16,), of x; rounding no longer breaks bounds."""
    full = np.empty(16)
    for j in range(9):
        full[j] = min(max(x[j], lower[j]), upper[j])
    for i in range(6):
        full[9 + i] = twist[i]
        for j in range(9):
            full[9 + i] -= J[i, j] * full[j]
    full[15] = max(x[9], 0.0)
    return full
