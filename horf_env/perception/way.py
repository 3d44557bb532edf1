"""Shortest way of the base on a map of obstacle points, by fast sweeping (Zhao 2005)."""

from __future__ import annotations

from typing import Final

import numba
import numpy as np

from horf_env.types import FloatArray, IntArray

CELL: Final = 0.1
"""Edge of a cell [m]."""

CELLS: Final = 64
"""Cells along each side: 3.2 m to each side of the base, all that the map holds."""

_LOOK_AHEAD = 0.8  # m
_ARM_HEIGHT = 1.15  # m; what hangs higher is above the arm in its ready pose
# Nearer than this [m] to what the base could hit, or to what only the arm could, it is blocked; a
# blocked metre counts as many. It is not infinite: the robot may stand in such a cell.
_BASE_ROOM, _ARM_ROOM, _BLOCKED = 0.34, 0.05, 15.0
# Below this distance [m] a metre counts as up to seven, so that the way keeps to the middle.
_COMFORT, _NARROW_COST = 0.75, 6.0
_ARM_BONUS = 0.1  # m; the arm yields, the base does not
# A metre beyond the map, and what leaving it costs at least: it is not known what is there.
_OUTSIDE, _LEAVING = 1.2, 1.0
_ROUNDS, _CONVERGED = 8, 1e-3  # m
_FAR = 100.0  # m; more than any way on the map costs


@numba.njit(cache=True)
def way(
    points: FloatArray,
    base_height: float,
    base: FloatArray,
    goal: FloatArray,
    stands: FloatArray,
    first: IntArray,
) -> tuple[FloatArray, float, float]:
    """The way from the base to where it can reach the goal.

    Args:
        points: Obstacle points in the world, shape (N, 3), m.
        base_height: Of the base [m]; what is higher meets only the arm.
        base: Position of the base, shape (2,), m.
        goal: Position of the goal, shape (2,), m.
        stands: What it costs to end the way in cells around the goal, shape (m, m), m; inf where
            the arm does not reach the goal from.
        first: Numbers of the cell that the first row and column of `stands` are for, shape (2,).

    Returns:
        A point 0.8 m ahead on the way or its end, shape (2,), m; the length up to there [m]; and
        the cost of the whole way [m], which counts narrow places up to seven times.
    """
    corner = np.empty(2, dtype=np.int64)
    for k in range(2):
        corner[k] = int(np.floor(base[k] / CELL)) - CELLS // 2
    low, high = _gaps(points, base_height, corner)
    step = np.empty((CELLS, CELLS))
    for i in range(CELLS):
        for j in range(CELLS):
            gap = min(low[i, j], high[i, j] + _ARM_BONUS)
            step[i, j] = CELL * (1.0 + _NARROW_COST * max(1.0 - gap / _COMFORT, 0.0))
            if low[i, j] < _BASE_ROOM or high[i, j] < _ARM_ROOM:
                step[i, j] = CELL * _BLOCKED
    cost = _ends(low, corner, goal, stands, first)
    _sweep(cost, step)
    return _follow(cost, corner, base)


@numba.njit(cache=True)
def _gaps(
    points: FloatArray, base_height: float, corner: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Distances [m] to what base and arm could hit, each of shape (CELLS, CELLS)."""
    low, high = np.full((CELLS, CELLS), _FAR), np.full((CELLS, CELLS), _FAR)
    for k in range(len(points)):
        i = int(np.floor(points[k, 0] / CELL)) - corner[0]
        j = int(np.floor(points[k, 1] / CELL)) - corner[1]
        if 0 <= i < CELLS and 0 <= j < CELLS and points[k, 2] < _ARM_HEIGHT:
            if points[k, 2] < base_height:
                low[i, j] = 0.0
            else:
                high[i, j] = 0.0
    _chamfer(low)
    _chamfer(high)
    return low, high


@numba.njit(cache=True)
def _chamfer(distance: FloatArray) -> None:
    """Distances [m] to the cells with 0, in place: two passes over eight neighbours."""
    n = len(distance)
    diagonal = CELL * np.sqrt(2.0)
    for i in range(n):
        for j in range(n):
            least = distance[i, j]
            if i > 0:
                least = min(least, distance[i - 1, j] + CELL)
                if j > 0:
                    least = min(least, distance[i - 1, j - 1] + diagonal)
                if j < n - 1:
                    least = min(least, distance[i - 1, j + 1] + diagonal)
            if j > 0:
                least = min(least, distance[i, j - 1] + CELL)
            distance[i, j] = least
    for i in range(n - 1, -1, -1):
        for j in range(n - 1, -1, -1):
            least = distance[i, j]
            if i < n - 1:
                least = min(least, distance[i + 1, j] + CELL)
                if j > 0:
                    least = min(least, distance[i + 1, j - 1] + diagonal)
                if j < n - 1:
                    least = min(least, distance[i + 1, j + 1] + diagonal)
            if j < n - 1:
                least = min(least, distance[i, j + 1] + CELL)
            distance[i, j] = least


@numba.njit(cache=True)
def _ends(
    low: FloatArray, corner: IntArray, goal: FloatArray, stands: FloatArray, first: IntArray
) -> FloatArray:
    """Costs of the cells in which a way may end or leave the map, _FAR elsewhere."""
    cost = np.full((CELLS, CELLS), _FAR)
    for i in range(CELLS):
        for j in range(CELLS):
            if i in (0, CELLS - 1) or j in (0, CELLS - 1):
                dx = (corner[0] + i + 0.5) * CELL - goal[0]
                dy = (corner[1] + j + 0.5) * CELL - goal[1]
                cost[i, j] = _LEAVING + _OUTSIDE * np.sqrt(dx * dx + dy * dy)
            a, b = corner[0] + i - first[0], corner[1] + j - first[1]
            if 0 <= a < stands.shape[0] and 0 <= b < stands.shape[1] and low[i, j] > _BASE_ROOM:
                cost[i, j] = min(cost[i, j], stands[a, b])
    return cost


@numba.njit(cache=True)
def _sweep(cost: FloatArray, step: FloatArray) -> None:
    """Solve |grad cost| = step / CELL in place, from the ends that are there."""
    n = len(cost)
    for _ in range(_ROUNDS):
        change = 0.0
        for direction in range(4):
            for k in range(n):
                i = k if direction & 1 else n - 1 - k
                for m in range(n):
                    j = m if direction & 2 else n - 1 - m
                    a = min(cost[max(i - 1, 0), j], cost[min(i + 1, n - 1), j])
                    b = min(cost[i, max(j - 1, 0)], cost[i, min(j + 1, n - 1)])
                    f = step[i, j]
                    new = min(a, b) + f
                    if abs(a - b) < f:
                        new = 0.5 * (a + b + np.sqrt(2.0 * f * f - (a - b) * (a - b)))
                    if new < cost[i, j]:
                        change = max(change, cost[i, j] - new)
                        cost[i, j] = new
        if change < _CONVERGED:
            break


@numba.njit(cache=True)
def _follow(
    cost: FloatArray, corner: IntArray, base: FloatArray
) -> tuple[FloatArray, float, float]:
    """Go down the costs from the middle; see `way`."""
    i = j = CELLS // 2
    length, whole = 0.0, cost[i, j]
    while length < _LOOK_AHEAD:
        best_i, best_j, steepest = i, j, 0.0
        for di in range(-1, 2):
            for dj in range(-1, 2):
                a, b = i + di, j + dj
                if 0 <= a < CELLS and 0 <= b < CELLS and (di != 0 or dj != 0):
                    far = np.sqrt(di * di + dj * dj)
                    slope = (cost[i, j] - cost[a, b]) / far
                    if slope > steepest:
                        best_i, best_j, steepest = a, b, slope
        if best_i == i and best_j == j:
            break
        length += CELL * np.sqrt((best_i - i) ** 2 + (best_j - j) ** 2)
        i, j = best_i, best_j
    ahead = np.empty(2)
    ahead[0], ahead[1] = (corner[0] + i + 0.5) * CELL, (corner[1] + j + 0.5) * CELL
    return ahead, length, whole
