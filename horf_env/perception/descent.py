"""Where to drive on a grid of the costs of ways."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray

_LOOK_AHEAD = 0.8  # m
_TURN_COST, _DIRECTIONS = 0.6, 32  # m of way for a rad


@njit(cache=True)
def descend(
    cost: FloatArray, step: FloatArray, cell: float, base: FloatArray, yaw: float
) -> tuple[FloatArray, float, float]:
    """The way down the costs, or straight to a place 0.8 m away if that saves a turn.

    Without a cost of turns the robot would look right and left without end where two ways cost
    about the same, each of which looks worse once it is seen.

    Args:
        cost: Of the ways from the cells, shape (n, m), m.
        step: Of crossing them, shape (n, m), m.
        cell: Edge of a cell [m].
        base: Position, counted from the corner of the grid, shape (2,), m.
        yaw: Direction, rad.

    Returns:
        The place, or the end of the way if that is nearer, shape (2,), m; the length of way up to
        there [m]; and the cost of the whole way [m].
    """
    place, length, whole = _follow(cost, cell, base)
    if length < _LOOK_AHEAD:
        return place, length, whole
    best = whole + _TURN_COST * _turn(base, yaw, place)
    for k in range(_DIRECTIONS):
        angle = yaw + 2.0 * np.pi * k / _DIRECTIONS
        total, other = _straight(cost, step, cell, base, angle)
        total += _TURN_COST * _turn(base, yaw, other)
        if total < best:
            best, place = total, other
    return place, length, whole


@njit(cache=True)
def _straight(
    cost: FloatArray, step: FloatArray, cell: float, base: FloatArray, angle: float
) -> tuple[float, FloatArray]:
    """Cost of the way that begins straight in a direction [rad], and the place 0.8 m away."""
    place, total, i, j = base.copy(), 0.0, 0, 0
    for _ in range(int(_LOOK_AHEAD / cell)):
        place[0] += cell * np.cos(angle)
        place[1] += cell * np.sin(angle)
        i, j = _cell(cost, cell, place)
        total += step[i, j]
    return total + cost[i, j], place


@njit(cache=True)
def _cell(cost: FloatArray, cell: float, place: FloatArray) -> tuple[int, int]:
    """The cell of a place, or the one nearest to it."""
    i, j = int(np.floor(place[0] / cell)), int(np.floor(place[1] / cell))
    return min(max(i, 0), cost.shape[0] - 1), min(max(j, 0), cost.shape[1] - 1)


@njit(cache=True)
def _turn(base: FloatArray, yaw: float, place: FloatArray) -> float:
    """Angle that the base turns to face a place [rad]."""
    return angle_between(np.arctan2(place[1] - base[1], place[0] - base[0]), yaw)


@njit(cache=True)
def angle_between(one: float, other: float) -> float:
    """Of two directions [rad], in [0, pi]."""
    return np.abs(np.arctan2(np.sin(one - other), np.cos(one - other)))


@njit(cache=True)
def _follow(cost: FloatArray, cell: float, base: FloatArray) -> tuple[FloatArray, float, float]:
    """From cell to cell where the costs fall most; see `descend`."""
    i, j = _cell(cost, cell, base)
    length, whole = 0.0, cost[i, j]
    while length < _LOOK_AHEAD:
        best_i, best_j = _lowest(cost, i, j)
        if best_i == i and best_j == j:
            break
        length += cell * np.sqrt((best_i - i) ** 2 + (best_j - j) ** 2)
        i, j = best_i, best_j
    place = np.empty(2)
    place[0], place[1] = (i + 0.5) * cell, (j + 0.5) * cell
    return place, length, whole


@njit(cache=True)
def _lowest(cost: FloatArray, i: int, j: int) -> tuple[int, int]:
    """The neighbour of a cell to which the costs fall most, itself where they do not."""
    best_i, best_j, steepest = i, j, 0.0
    for di in range(-1, 2):
        for dj in range(-1, 2):
            a, b = i + di, j + dj
            if 0 <= a < cost.shape[0] and 0 <= b < cost.shape[1] and (di != 0 or dj != 0):
                slope = (cost[i, j] - cost[a, b]) / np.sqrt(di * di + dj * dj)
                if slope > steepest:
                    best_i, best_j, steepest = a, b, slope
    return best_i, best_j
