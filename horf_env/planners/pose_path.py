"""The cheapest way of poses from where the base is: turns on the spot and straight runs."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numba import njit

from horf_env.planners.pose_costs import BACK_COST, LENGTHS, STEPS, YAWS, PoseCosts
from horf_env.types import FloatArray, IntArray

AHEAD: Final = 1
BACK: Final = -1
LEFT: Final = 2
RIGHT: Final = -2

_MOST = 120  # moves


class PosePath(NamedTuple):
    """Poses and the moves between them.

    Attributes:
        places: Positions from the corner of the window, shape (n, 2), in cells.
        yaws: Directions, shape (n,), rad.
        moves: Between one pose and the next, shape (n - 1,).
    """

    places: FloatArray
    yaws: FloatArray
    moves: IntArray

    @property
    def turns(self) -> int:
        """Number of turns on the spot that come first."""
        runs = np.flatnonzero(np.abs(self.moves) == AHEAD)
        return int(runs[0]) if len(runs) else len(self.moves)

    def run(self, begin: int, length: float) -> FloatArray:
        """A place on the run that begins with a move, shape (2,), in cells.

        Args:
            begin: Number of the move.
            length: How far from there [cells]; less where the run changes its direction.
        """
        reverse = np.flatnonzero(self.moves[begin:] == -self.moves[begin])
        last = begin + int(reverse[0]) if len(reverse) else len(self.moves)
        ways = np.cumsum(np.hypot(*np.diff(self.places[begin : last + 1], axis=0).T))
        return self.places[begin + 1 + min(int(np.searchsorted(ways, length)), len(ways) - 1)]


def pose_path(costs: PoseCosts, x: float, y: float, yaw: float) -> PosePath:
    """The way from a pose to where it ends, or to the border of the window.

    Args:
        costs: Of the poses of the window.
        x: Position from the corner of the window, in cells.
        y: The same.
        yaw: Direction, rad.
    """
    return PosePath(*_path(costs.cost, costs.known, costs.factor, costs.turn, x, y, yaw))


@njit(cache=True)
def _path(
    cost: FloatArray,
    known: FloatArray,
    factor: FloatArray,
    turn: FloatArray,
    x: float,
    y: float,
    yaw: float,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """See `pose_path`."""
    places, yaws = np.empty((_MOST + 1, 2)), np.empty(_MOST + 1)
    moves = np.empty(_MOST, dtype=np.int64)
    last = cost.shape[0] - 1
    i, j = min(max(int(x), 0), last), min(max(int(y), 0), last)
    h = _first_direction(cost, turn, i, j, yaw % (2.0 * np.pi))
    count = 0
    while True:
        places[count, 0], places[count, 1], yaws[count] = i + 0.5, j + 0.5, YAWS[h]
        if count == _MOST or known[i, j, h] <= cost[i, j, h]:
            return places[: count + 1], yaws[: count + 1], moves[:count]
        i, j, h, moves[count] = _cheapest(cost, factor, turn, i, j, h)
        count += 1


@njit(cache=True)
def _first_direction(cost: FloatArray, turn: FloatArray, i: int, j: int, yaw: float) -> int:
    """Of the two directions that are next to one, the one that its way leads over."""
    h, n = len(YAWS) - 1, len(YAWS)
    while YAWS[h] > yaw:
        h -= 1
    left = (h + 1) % n
    turned = (yaw - YAWS[h]) / ((YAWS[left] - YAWS[h]) % (2.0 * np.pi))
    over_left = cost[i, j, left] + (1.0 - turned) * turn[i, j, h]
    return left if over_left < cost[i, j, h] + turned * turn[i, j, h] else h


@njit(cache=True)
def _cheapest(
    cost: FloatArray, factor: FloatArray, turn: FloatArray, i: int, j: int, h: int
) -> tuple[int, int, int, int]:
    """The next pose on the way, and the move to it."""
    left, right = (h + 1) % len(YAWS), (h - 1) % len(YAWS)
    best, a, b, c, move = cost[i, j, left] + turn[i, j, h], i, j, left, LEFT
    to_right = cost[i, j, right] + turn[i, j, right]
    if to_right < best:
        best, c, move = to_right, right, RIGHT
    for sign, weight in ((AHEAD, 1.0), (BACK, BACK_COST)):
        k, m = i + sign * STEPS[h, 0], j + sign * STEPS[h, 1]
        if 0 <= k < cost.shape[0] and 0 <= m < cost.shape[1]:
            step = weight * LENGTHS[h] * 0.5 * (factor[i, j, h] + factor[k, m, h])
            if cost[k, m, h] + step < best:
                best, a, b, c, move = cost[k, m, h] + step, k, m, h, sign
    return a, b, c, move
