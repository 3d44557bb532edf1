"""Ways of the base to where its arm reaches a goal, on all that has been seen of the ground."""

from __future__ import annotations

from typing import Final, NamedTuple, Protocol

import numpy as np
from numba import njit
from scipy.ndimage import distance_transform_edt

from horf_env.perception.descent import descend
from horf_env.perception.enclosed import enclosed
from horf_env.perception.sweeping import BASE_EASE, crossing_costs, sweep
from horf_env.robot.footprint import CARRIED_HEIGHT, GUARDED_HEIGHT
from horf_env.types import BoolArray, FloatArray, IntArray

CELL: Final = 0.05
"""Edge of a cell [m]."""

_TIGHT_STAND = 10.0  # m of way; what it costs to end one where the base cannot turn
_AROUND = 6.0  # m; how far ways lead beyond start and goal
_BORDER = 1.0  # m; how far around what is known
_KNOWN = 1.2  # m around the base: what is not among the known points there is gone
_REPLAN, _LOOK = 10, 3  # updates
FAR: Final = 1e4
"""More than any way costs [m]."""

# A metre that nobody has looked at counts at least so many: seen gaps between obstacles look dear
# beside what is not known, which in clutter is no better.
_UNSEEN = 2.0
# Ground so near to an obstacle that nobody has seen is taken for a part of it: bases hit sides that
# they had not looked at. With 0.35 m gaps close that are open.
_HIDDEN = 0.25  # m
_INSIDE = 0.7  # m; so near to seen sides it is, where they enclose it
_SIGHT = 5.1  # m around the base, that of the camera
_HEIGHTS = (0.025, 0.175, 0.325)  # m; ground counts as seen if one of these was, over it
_UNDER = 0.27  # m; the ground under the base
_LOOKED = round(_SIGHT / CELL)  # cells


class SeenSpace(Protocol):
    """What the senses have shown of the world."""

    def surfaces(self, place: FloatArray) -> FloatArray:
        """Points of surfaces that were seen around a place (2,), in the world, shape (N, 3), m."""

    def seen(self, points: FloatArray) -> BoolArray:
        """Which of the points (N, 3) [m] were looked at, shape (N,)."""

    def presume(self, behind: float) -> None:
        """See `ObstacleMemory`."""


class GroundPlan(NamedTuple):
    """Ways from all cells of a grid, shape (n, m).

    Attributes:
        offset: Corner of the grid in the world, shape (2,), m.
        low: Distance to what the base could hit [m].
        high: The same to what only the arm could hit.
        step: Cost of crossing a cell [m].
        ends: Cost of ending a way in a cell [m]; more than any way costs where it cannot end.
        cost: Cost of the way from a cell [m].
    """

    offset: FloatArray
    low: FloatArray
    high: FloatArray
    step: FloatArray
    ends: FloatArray
    cost: FloatArray


class GroundWays:
    """Remembers what was seen on the ground and plans on it.

    Surfaces that were seen count and the ground right behind them, but not all that they may hide:
    half of the gaps would close, and the robot finds out when it gets there.

    Attributes:
        plan: The last plan.
    """

    plan: GroundPlan

    def __init__(
        self,
        start: FloatArray,
        goal: FloatArray,
        stands: FloatArray,
        first: IntArray,
        space: SeenSpace,
    ) -> None:
        """Nothing is known.

        Args:
            start: Position of the base, shape (2,), m.
            goal: Position of the goal, shape (2,), m.
            stands: What it costs to end a way in cells around the goal, shape (m, m), m; inf where
                the arm does not reach the goal from.
            first: Numbers of the cell of the first row and column of `stands`, shape (2,).
            space: Tells what was seen.
        """
        self._space = space
        half = 0.5 * float(np.abs(goal - start).max()) + _AROUND
        self._corner = cell_of(0.5 * (start + goal) - half)
        self._low = np.zeros([int(2 * half / CELL) + 1] * 2, dtype=np.bool_)
        self._high = np.zeros_like(self._low)
        self._seen = np.zeros_like(self._low)
        self._avoided = np.zeros_like(self._low)
        self._stands, self._first_stand = np.minimum(stands, FAR), first
        self._updates = 0
        self.surprises = 0.0
        """By how much ways from where the robot was have become longer [m]."""

    def update(self, base: FloatArray) -> None:
        """Take in what is seen now, and every tenth time plan anew.

        Args:
            base: Position of the base, shape (2,), m.
        """
        _remember(self._low, self._high, self._space.surfaces(base), base, self._corner)
        if self._updates == 0:
            self._plan(base)
        elif self._updates % _REPLAN == 0:
            before = self.ahead(base, 0.0)[2]
            self._plan(base)
            self.surprises += self.ahead(base, 0.0)[2] - before
        elif self._updates % _LOOK == 0:
            self._look(base)
        self._updates += 1

    def avoid(self, place: FloatArray) -> None:
        """Take a place (2,) [m] for an obstacle of the base, from the next plan on."""
        i, j = np.clip(cell_of(place) - self._corner, 0, np.array(self._low.shape) - 1)
        self._avoided[i, j] = True

    def ahead(self, base: FloatArray, yaw: float) -> tuple[FloatArray, float, float]:
        """The way from a pose of the base.

        Args:
            base: Position, shape (2,), m.
            yaw: Direction, rad.

        Returns:
            A point 0.8 m ahead on the way or its end, shape (2,), m; the length up to there [m];
            and the cost of the whole way [m], which counts narrow places several times.
        """
        plan = self.plan
        place, length, cost = descend(plan.cost, plan.step, CELL, base - plan.offset, yaw)
        return place + plan.offset, length, cost

    def _plan(self, base: FloatArray) -> None:
        """Costs of crossing cells and of the ways from them, in the part that matters."""
        self._look(base)
        first, last = self._part(base)
        part = np.s_[first[0] : last[0], first[1] : last[1]]
        low, high = _distance(self._obstacles(part)), _distance(self._high[part])
        step = crossing_costs(low, high, CELL)
        step = np.where(self._seen[part], step, np.maximum(step, _UNSEEN * CELL))
        ends = self._ends(first, low)
        cost = ends.copy()
        sweep(cost, step)
        self.plan = GroundPlan(
            CELL * np.asarray(self._corner + first, float), low, high, step, ends, cost
        )

    def _obstacles(self, part: tuple[slice, slice]) -> BoolArray:
        """Where the base cannot go: what was seen, what that hides, and what it keeps off."""
        low, unseen = self._low[part], ~self._seen[part]
        away = _distance(low)
        inside = enclosed(low, unseen & (away < _INSIDE), round(_INSIDE / CELL))
        return low | unseen & (away < _HIDDEN) | inside | self._avoided[part]

    def _ends(self, first: IntArray, low: FloatArray) -> FloatArray:
        """Cost of ending a way in the cells of the part that begins with cell `first`."""
        ends = np.full(low.shape, FAR)
        (i, j), (m, n) = self._first_stand - self._corner - first, self._stands.shape
        part = np.s_[i : i + m, j : j + n]
        ends[part] = self._stands + np.where(low[part] < BASE_EASE, _TIGHT_STAND, 0.0)
        return ends

    def _look(self, base: FloatArray) -> None:
        """Notice which ground around the base was looked at, or is under it."""
        _set_around(self._seen, base / CELL - self._corner, _UNDER / CELL)
        cells, points = _unset_around(self._seen, self._corner, cell_of(base), _LOOKED)
        seen = np.zeros(len(cells), dtype=np.bool_)
        for height in _HEIGHTS:
            points[:, 2] = height
            seen |= self._space.seen(points)
        self._seen[cells[seen, 0], cells[seen, 1]] = True

    def _part(self, base: FloatArray) -> tuple[IntArray, IntArray]:
        """Corners of the rectangle around base, goal and all that is known."""
        known = np.argwhere(self._low | self._high | self._avoided)
        ends = self._first_stand - self._corner
        marks = np.vstack([known, cell_of(base) - self._corner, ends, ends + self._stands.shape])
        border = round(_BORDER / CELL)
        first = np.clip(marks.min(axis=0) - border, 0, None)
        return first, np.minimum(marks.max(axis=0) + border, self._low.shape)


def cell_of(place: FloatArray) -> IntArray:
    """Number of the cell of a place (2,) [m]."""
    return np.floor(place / CELL).astype(np.int64)


def _distance(cells: BoolArray) -> FloatArray:
    """Of each cell to the nearest one that is set [m]."""
    if not cells.any():
        return np.full(cells.shape, FAR)
    return np.asarray(CELL * distance_transform_edt(~cells))


@njit(cache=True)
def _set_around(cells: BoolArray, middle: FloatArray, radius: float) -> None:
    """Set the cells whose middles are nearer to a place than a radius; all in cells."""
    rows, columns = cells.shape
    for i in range(max(int(middle[0] - radius), 0), min(int(middle[0] + radius) + 1, rows)):
        for j in range(max(int(middle[1] - radius), 0), min(int(middle[1] + radius) + 1, columns)):
            if np.hypot(i + 0.5 - middle[0], j + 0.5 - middle[1]) < radius:
                cells[i, j] = True


@njit(cache=True)
def _unset_around(
    cells: BoolArray, corner: IntArray, middle: IntArray, around: int
) -> tuple[IntArray, FloatArray]:
    """The cells of a square that are not set: numbers (N, 2), and middles on the floor (N, 3) [m].

    Args:
        cells: Grid.
        corner: Number of its first cell in the world, shape (2,).
        middle: Number of the square's middle in the world, shape (2,).
        around: Half the edge of the square.
    """
    rows, columns = cells.shape
    numbers = np.empty((4 * around * around, 2), dtype=np.int64)
    middles, found = np.zeros((len(numbers), 3)), 0
    first_i, first_j = middle[0] - corner[0] - around, middle[1] - corner[1] - around
    for i in range(max(first_i, 0), min(first_i + 2 * around, rows)):
        for j in range(max(first_j, 0), min(first_j + 2 * around, columns)):
            if not cells[i, j]:
                numbers[found, 0], numbers[found, 1] = i, j
                middles[found, 0] = (i + corner[0] + 0.5) * CELL
                middles[found, 1] = (j + corner[1] + 0.5) * CELL
                found += 1
    return numbers[:found], middles[:found]


@njit(cache=True)
def _remember(
    low: BoolArray,
    high: BoolArray,
    points: FloatArray,
    base: FloatArray,
    corner: IntArray,
) -> None:
    """Replace what is remembered of the surroundings by the points."""
    rows, columns = low.shape
    middle_i = int(np.floor(base[0] / CELL)) - corner[0]
    middle_j = int(np.floor(base[1] / CELL)) - corner[1]
    around = int(_KNOWN / CELL)
    for i in range(max(middle_i - around, 0), min(middle_i + around + 1, rows)):
        for j in range(max(middle_j - around, 0), min(middle_j + around + 1, columns)):
            if (i - middle_i) ** 2 + (j - middle_j) ** 2 < around**2:
                low[i, j] = high[i, j] = False
    for k in range(len(points)):
        i = int(np.floor(points[k, 0] / CELL)) - corner[0]
        j = int(np.floor(points[k, 1] / CELL)) - corner[1]
        if 0 <= i < rows and 0 <= j < columns and points[k, 2] < CARRIED_HEIGHT:
            if points[k, 2] < GUARDED_HEIGHT:
                low[i, j] = True
            else:
                high[i, j] = True
