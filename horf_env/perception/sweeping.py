"""Costs of ways on a grid by fast sweeping (Zhao 2005)."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray

# Nearer than this [m] to what the base could hit, or to what only the arm could, a cell is blocked;
# a blocked metre counts as many. It is not infinite: the robot may stand in such a cell.
_BASE_ROOM, _ARM_ROOM, _BLOCKED = 0.36, 0.15, 15.0
# Nearer than this [m] there is no room for turns; metres more that such a metre counts.
BASE_EASE, _ARM_EASE, _UNEASY = 0.41, 0.30, 4.0
# Below this distance [m] a metre counts as up to seven, so that the way keeps to the middle.
COMFORT, NARROW_COST = 0.75, 6.0
_ARM_BONUS = 0.1  # m; the arm yields, the base does not
_ROUNDS, _CONVERGED = 8, 1e-3  # m


@njit(cache=True)
def crossing_costs(low: FloatArray, high: FloatArray, cell: float) -> FloatArray:
    """Of crossing each cell.

    Args:
        low: Distance of the cells to what the base could hit, shape (n, m), m.
        high: The same to what only the arm could hit.
        cell: Edge of a cell [m].

    Returns:
        Shape (n, m), m.
    """
    costs = np.empty(low.shape)
    for i in range(low.shape[0]):
        for j in range(low.shape[1]):
            base, arm = low[i, j], high[i, j]
            gap = min(base, arm + _ARM_BONUS)
            factor = 1.0 + NARROW_COST * max(1.0 - gap / COMFORT, 0.0)
            if base < _BASE_ROOM or arm < _ARM_ROOM:
                factor = _BLOCKED
            elif base < BASE_EASE or arm < _ARM_EASE:
                factor += _UNEASY
            costs[i, j] = cell * factor
    return costs


@njit(cache=True)
def sweep(cost: FloatArray, step: FloatArray) -> None:
    """Spread the costs of ways from their ends, in place: |grad cost| = step / edge of a cell.

    Args:
        cost: At the ends of ways what it costs to end there, elsewhere more than any way costs;
            shape (n, m), m.
        step: Of crossing a cell, shape (n, m), m.
    """
    for _ in range(_ROUNDS):
        change = 0.0
        for direction in range(4):
            change = max(change, _sweep_once(cost, step, direction & 1 > 0, direction & 2 > 0))
        if change < _CONVERGED:
            break


@njit(cache=True)
def _sweep_once(cost: FloatArray, step: FloatArray, up: bool, right: bool) -> float:
    """One pass over all cells; returns the largest change [m]."""
    rows, columns = cost.shape
    change = 0.0
    for k in range(rows):
        i = k if up else rows - 1 - k
        for m in range(columns):
            j = m if right else columns - 1 - m
            a = min(cost[max(i - 1, 0), j], cost[min(i + 1, rows - 1), j])
            b = min(cost[i, max(j - 1, 0)], cost[i, min(j + 1, columns - 1)])
            f = step[i, j]
            new = min(a, b) + f
            if abs(a - b) < f:
                new = 0.5 * (a + b + np.sqrt(2.0 * f * f - (a - b) * (a - b)))
            if new < cost[i, j]:
                change = max(change, cost[i, j] - new)
                cost[i, j] = new
    return change
