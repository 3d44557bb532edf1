"""What the base does next where there is little room: an arc, a turn on the spot, or back."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.perception import GroundPlan
from horf_env.perception.ways import CELL
from horf_env.planners.pose_costs import (
    BACK_COST,
    TURN_COST,
    WINDOW,
    pose_cost,
    pose_costs,
    pose_factor,
)
from horf_env.types import FloatArray

# Lengths [m] and turns [rad]. On a bend tighter than 1.2 m the inner side of the base sweeps ground
# that a camera on its front, 87 degrees wide, does not see.
_LENGTHS = (0.25, 0.25, 0.25, 0.25, 0.25, 0.0, 0.0, -0.25)
_TURNS = (0.0, 0.1, -0.1, 0.2, -0.2, 0.25, -0.25, 0.0)
_MANEUVERS = np.column_stack([_LENGTHS, _TURNS])
_PARTS = 5
_CHANGE = 0.05  # m; what another maneuver than the last one has to save
_TURN, _BACK = 1.0, 0.3  # rad/s on the spot, m/s backwards


class Maneuvers:
    """Chooses the maneuver from which the way is cheapest, each time for the pose it is in."""

    def __init__(self) -> None:
        """Nothing is planned."""
        self._plan: GroundPlan | None = None
        self._last = -1

    def choose(
        self, plan: GroundPlan, base: FloatArray, yaw: float, speed: float
    ) -> tuple[float, float]:
        """What to do now.

        Args:
            plan: Ways of a disc on the ground; poses are planned anew when it changes.
            base: Position of the base, shape (2,), m.
            yaw: Its direction, rad.
            speed: Of driving ahead [m/s].

        Returns:
            Speed [m/s], negative backwards, and turn [rad/s] of the base.
        """
        x, y = (base - plan.offset) / CELL
        if plan is not self._plan:
            self._plan, self._first = plan, (int(x) - WINDOW // 2, int(y) - WINDOW // 2)
            self._costs = pose_costs(plan.low, plan.high, plan.ends, plan.cost, self._first)
        totals = _totals(self._costs, plan.low, plan.high, self._first, x, y, yaw)
        totals[self._last] -= _CHANGE if self._last >= 0 else 0.0
        self._last = int(totals.argmin())
        length, turn = _MANEUVERS[self._last]
        if length > 0.0:
            return speed, float(turn / length) * speed
        return (-_BACK, 0.0) if length < 0.0 else (0.0, float(np.sign(turn)) * _TURN)


@njit(cache=True)
def _totals(
    costs: FloatArray,
    low: FloatArray,
    high: FloatArray,
    first: tuple[int, int],
    x: float,
    y: float,
    yaw: float,
) -> FloatArray:
    """Costs of the ways from a pose that begin with each maneuver [m]."""
    totals = np.empty(len(_MANEUVERS))
    for k in range(len(_MANEUVERS)):
        length, turn = _MANEUVERS[k] / _PARTS
        px, py, direction, total = x, y, yaw, 0.0
        for _ in range(_PARTS):
            direction += 0.5 * turn
            px += length / CELL * np.cos(direction)
            py += length / CELL * np.sin(direction)
            direction += 0.5 * turn
            total += _part_cost(length, turn, pose_factor(low, high, px, py, direction))
        totals[k] = total + pose_cost(costs, px - first[0], py - first[1], direction)
    return totals


@njit(cache=True)
def _part_cost(length: float, turn: float, factor: float) -> float:
    """Of a part of a maneuver where a metre counts as `factor` metres [m].

    The turn of an arc is not dearer where it is narrow: it was, and the base turned on the spot
    there instead, where it hit more.
    """
    turned = TURN_COST * np.abs(turn)
    if length > 0.0:
        return length * factor + 0.5 * turned
    return (-BACK_COST * length + turned) * factor
