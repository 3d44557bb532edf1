"""Costs of ways for the base as it is: longer than wide, with the arm before it.

`GroundWays` plans for a disc, and a disc turns everywhere. This plans poses, position and
direction, in a window around the base, and takes what lies beyond from the ways of the disc.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numba import njit

from horf_env.perception.descent import angle_between
from horf_env.perception.ways import CELL, FAR
from horf_env.types import FloatArray

WINDOW: Final = 56
"""Cells along each side of the window."""

TURN_COST: Final = 0.6
"""Metres of way that a turn by a rad counts."""

BACK_COST: Final = 3.0
"""Metres that one backwards counts: nobody looks there."""

# Sixteen directions whose steps end in the middle of cells.
_QUARTER = np.array([(1, 0), (2, 1), (1, 1), (1, 2)])
_LEFT = np.array([(0, 1), (-1, 0)])  # turns a row by a quarter
STEPS: Final = np.vstack([_QUARTER @ np.linalg.matrix_power(_LEFT, k) for k in range(4)])
"""Cells that a step goes in each of the directions, shape (16, 2)."""
LENGTHS: Final = CELL * np.hypot(STEPS[:, 0], STEPS[:, 1])
"""Of these steps [m]."""
YAWS: Final = np.arctan2(STEPS[:, 1], STEPS[:, 0]) % (2.0 * np.pi)
"""The directions [rad]."""
_GAPS = (np.roll(YAWS, -1) - YAWS) % (2.0 * np.pi)
# Four discs of 0.27 m, in a row, cover the base; points of the arm in its ready pose [m ahead]. A
# tucked arm is shorter: its own outline, with more room around it, reached no more goals.
_DISCS = np.array([-0.259, -0.076, 0.106, 0.289])
_ARM = np.array([0.0, 0.25, 0.45])
# Nearer than this [m] to the middle of a disc, or to a point of the arm, a pose is blocked, and
# counts as so many metres, more the deeper it is in; up to the second distance it counts more.
_ROOM, _EASE, _ARM_ROOM, _ARM_EASE = 0.32, 0.40, 0.12, 0.25
_BLOCKED, _PER_DEPTH, _UNEASY = 15.0, 40.0, 3.0
_COMFORT, _NARROW, _ARM_BONUS = 0.6, 2.0, 0.1
_ROUNDS, _CONVERGED = 40, 1e-2  # m


@njit(cache=True)
def pose_factor(low: FloatArray, high: FloatArray, x: float, y: float, yaw: float) -> float:
    """How many metres a metre counts at a pose.

    Args:
        low: Distance of cells to what the base could hit, shape (n, m), m.
        high: The same to what only the arm could hit.
        x: Position from the corner of the grid, in cells.
        y: The same.
        yaw: Direction, rad.
    """
    base = _least(low, _DISCS, x, y, yaw)
    arm = _least(high, _ARM, x, y, yaw)
    if base < _ROOM:
        return _BLOCKED + _PER_DEPTH * (_ROOM - base)
    if arm < _ARM_ROOM:
        return _BLOCKED
    gap = min(base, arm + _ARM_BONUS)
    uneasy = max(_EASE - base, 0.0) / (_EASE - _ROOM)
    uneasy += max(_ARM_EASE - arm, 0.0) / (_ARM_EASE - _ARM_ROOM)
    return 1.0 + _NARROW * max(1.0 - gap / _COMFORT, 0.0) + _UNEASY * uneasy


@njit(cache=True)
def _least(distance: FloatArray, ahead: FloatArray, x: float, y: float, yaw: float) -> float:
    """Least distance [m] at places so many metres ahead of a pose."""
    least, c, s = np.inf, np.cos(yaw) / CELL, np.sin(yaw) / CELL
    for k in range(len(ahead)):
        i, j = int(np.floor(x + c * ahead[k])), int(np.floor(y + s * ahead[k]))
        i, j = min(max(i, 0), distance.shape[0] - 1), min(max(j, 0), distance.shape[1] - 1)
        least = min(least, distance[i, j])
    return least


class PoseCosts(NamedTuple):
    """Of the poses of a window, all of shape (WINDOW, WINDOW, 16).

    Attributes:
        cost: Of the way from a pose [m].
        known: The same where it was given, on the border and where ways end; elsewhere more than
            any way costs [m].
        factor: How many metres a metre counts there.
        turn: Cost of turning left to the next direction [m].
    """

    cost: FloatArray
    known: FloatArray
    factor: FloatArray
    turn: FloatArray


def pose_costs(
    low: FloatArray,
    high: FloatArray,
    ends: FloatArray,
    cost: FloatArray,
    first: tuple[int, int],
) -> PoseCosts:
    """Costs of the ways from all poses of a window.

    Args:
        low: See `pose_factor`.
        high: The same.
        ends: Cost of ending a way in a cell [m]; see `GroundPlan`.
        cost: Cost of the way of a disc from a cell [m]; for what lies beyond the window.
        first: Cell of the grid where the window begins.
    """
    factor, turn = _crossing(low, high, first)
    known = _known_costs(ends, cost, first)
    return PoseCosts(_swept(known, factor, turn), known, factor, turn)


@njit(cache=True)
def _swept(known: FloatArray, factor: FloatArray, turn: FloatArray) -> FloatArray:
    """Costs of the ways from all poses [m]."""
    costs = known.copy()
    for _ in range(_ROUNDS):
        change = 0.0
        for direction in range(4):
            change = max(change, _sweep(costs, factor, turn, direction & 1 > 0, direction & 2 > 0))
        if change < _CONVERGED:
            break
    return costs


@njit(cache=True)
def _crossing(
    low: FloatArray, high: FloatArray, first: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Factors of all poses of a window, and the costs of turning left to the next direction [m]."""
    factor = np.empty((WINDOW, WINDOW, len(YAWS)))
    turn = np.empty_like(factor)
    for i in range(WINDOW):
        for j in range(WINDOW):
            x, y = first[0] + i + 0.5, first[1] + j + 0.5
            for h in range(len(YAWS)):
                factor[i, j, h] = pose_factor(low, high, x, y, YAWS[h])
            for h in range(len(YAWS)):
                middle = pose_factor(low, high, x, y, YAWS[h] + 0.5 * _GAPS[h])
                whole = factor[i, j, h] + 2.0 * middle + factor[i, j, (h + 1) % len(YAWS)]
                turn[i, j, h] = TURN_COST * _GAPS[h] * 0.25 * whole
    return factor, turn


@njit(cache=True)
def _known_costs(ends: FloatArray, cost: FloatArray, first: tuple[int, int]) -> FloatArray:
    """Costs where ways end, and on the border of the window; elsewhere more than any way costs."""
    costs = np.full((WINDOW, WINDOW, len(YAWS)), FAR)
    middle = 0.5 * (WINDOW - 1)
    for i in range(WINDOW):
        for j in range(WINDOW):
            a, b = first[0] + i, first[1] + j
            if not (0 < a < cost.shape[0] - 1 and 0 < b < cost.shape[1] - 1):
                continue
            costs[i, j] = min(ends[a, b], FAR)
            # Steps are up to two cells long.
            if max(abs(i - middle), abs(j - middle)) > middle - 2.5:
                down_x, down_y = cost[a - 1, b] - cost[a + 1, b], cost[a, b - 1] - cost[a, b + 1]
                on = np.arctan2(down_y, down_x)
                for h in range(len(YAWS)):
                    whole = cost[a, b] + TURN_COST * angle_between(on, YAWS[h])
                    costs[i, j, h] = min(costs[i, j, h], whole)
    return costs


@njit(cache=True)
def _sweep(costs: FloatArray, factor: FloatArray, turn: FloatArray, up: bool, right: bool) -> float:
    """One pass over all poses; returns the largest change [m]."""
    change, n = 0.0, len(YAWS)
    for k in range(WINDOW):
        i = k if up else WINDOW - 1 - k
        for m in range(WINDOW):
            j = m if right else WINDOW - 1 - m
            for t in range(2 * n):  # twice around: turns lead from the last direction to the first
                h = t % n if up else (2 * n - 1 - t) % n
                new = _driven(costs, factor, i, j, h) if t < n else costs[i, j, h]
                left, to_right = (h + 1) % n, (h - 1) % n
                new = min(new, costs[i, j, left] + turn[i, j, h])
                new = min(new, costs[i, j, to_right] + turn[i, j, to_right])
                if new < costs[i, j, h]:
                    change = max(change, costs[i, j, h] - new)
                    costs[i, j, h] = new
    return change


@njit(cache=True)
def _driven(costs: FloatArray, factor: FloatArray, i: int, j: int, h: int) -> float:
    """Cost of the way from a pose, if it begins straight, ahead or back, or as it was before."""
    best = costs[i, j, h]
    for sign, weight in ((1, 1.0), (-1, BACK_COST)):
        a, b = i + sign * STEPS[h, 0], j + sign * STEPS[h, 1]
        if 0 <= a < WINDOW and 0 <= b < WINDOW:
            step = weight * LENGTHS[h] * 0.5 * (factor[i, j, h] + factor[a, b, h])
            best = min(best, costs[a, b, h] + step)
    return best
