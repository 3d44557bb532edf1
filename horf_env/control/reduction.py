"""The reduced QP in one compiled call: without the EE slack, and without rows that say nothing.

About a third of the rows stand for no point. The solver need not see these: its time goes with the
rows. Rows that no velocity within the box reaches could be left out as well, half of the others;
but the solver's way to the answer may lead past them, and its last digits then differ.
"""

from __future__ import annotations

import numba
import numpy as np

from horf_env.control.bounds import intersection
from horf_env.types import FloatArray, IntArray

# Cost of the shared slack of the avoidance rows, linear and quadratic. At 1e3 the slack is used
# only where no velocity keeps all rows (1 of 1980 problems otherwise; 68 with 10).
ROW_SLACK_COST = 1e3
MOST_ROW_SLACK = 1e3  # m/s; a bound that is never reached
ACTIVE = 1e-3  # m/s; a row this close to its bound counts as active


@numba.njit(cache=True)
def reduced(
    rows: FloatArray,
    h: FloatArray,
    boxes: FloatArray,
    J: FloatArray,
    twist: FloatArray,
    weights: FloatArray,
    linear: FloatArray,
    slack_weight: float,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, IntArray]:
    """The problem in x = (velocity (9), row slack (1)); see `ReducedQp`.

    Args:
        rows: G of all rows, shape (m, 9).
        h: Their right-hand sides, shape (m,).
        boxes: See `stacked_bounds`.
        J: Jacobian of the end effector, shape (6, 9).
        twist: That is asked for, shape (6,).
        weights: Diagonal of W, shape (9,).
        linear: Linear term, shape (9,).
        slack_weight: Weight L of the EE slack.

    Returns:
        P (10, 10), c (10,), G (k, 10), lower (10 + k,), upper (10 + k,), and which k rows are left,
        shape (k,).
    """
    low, high = intersection(boxes)
    P, c = _eliminated(J, twist, weights, linear, slack_weight)
    kept = _speaking(rows, h)
    G = np.empty((len(kept), 10))
    lower, upper = np.full(10 + len(kept), -np.inf), np.empty(10 + len(kept))
    lower[:9], upper[:9], lower[9], upper[9] = low, high, 0.0, MOST_ROW_SLACK
    for k in range(len(kept)):
        upper[10 + k], G[k, 9] = h[kept[k]], -1.0
        for j in range(9):
            G[k, j] = rows[kept[k], j]
    return P, c, G, lower, upper, kept


@numba.njit(cache=True)
def _eliminated(
    J: FloatArray, twist: FloatArray, weights: FloatArray, linear: FloatArray, L: float
) -> tuple[FloatArray, FloatArray]:
    """Eliminate the EE slack: P = W + J^T L J, c = linear - J^T L twist, L = slack weight."""
    P, c = np.zeros((10, 10)), np.full(10, ROW_SLACK_COST)
    for i in range(9):
        c[i] = linear[i]
        for k in range(6):
            c[i] -= L * J[k, i] * twist[k]
            for j in range(9):
                P[i, j] += L * J[k, i] * J[k, j]
        P[i, i] += weights[i]
    P[9, 9] = ROW_SLACK_COST
    return P, c


@numba.njit(cache=True)
def _speaking(rows: FloatArray, h: FloatArray) -> IntArray:
    """Which rows depend on the velocity, or are never kept or only just."""
    kept, count = np.empty(len(h), dtype=np.int64), 0
    for i in range(len(h)):
        speaks = not h[i] > ACTIVE
        for j in range(9):
            speaks = speaks or rows[i, j] != 0.0
        if speaks:
            kept[count] = i
            count += 1
    return kept[:count]


@numba.njit(cache=True)
def outcome(
    velocity: FloatArray, G: FloatArray, upper: FloatArray, J: FloatArray, twist: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What a velocity means.

    Args:
        velocity: Shape (9,).
        G: See `ReducedQp`, shape (k, 10).
        upper: See `ReducedQp`, shape (10 + k,).
        J: Jacobian of the end effector, shape (6, 9).
        twist: That was asked for, shape (6,).

    Returns:
        The part of the twist that is not followed, shape (6,), and what each row has left, negative
        where it is not kept, shape (k,), m/s.
    """
    slack, room = twist.copy(), upper[10:].copy()
    for j in range(9):
        for i in range(6):
            slack[i] -= J[i, j] * velocity[j]
        for k in range(len(G)):
            room[k] -= G[k, j] * velocity[j]
    return slack, room
