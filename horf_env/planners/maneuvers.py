"""What the base does next where there is little room: ahead, a turn on the spot, or back."""

from __future__ import annotations

from typing import Final

import numpy as np

from horf_env.perception import GroundPlan
from horf_env.perception.ways import CELL
from horf_env.planners.pose_costs import WINDOW, pose_costs
from horf_env.planners.pose_path import AHEAD, PosePath, pose_path
from horf_env.types import FloatArray

_LOOK_AHEAD: Final = 0.35  # m of way
_AT: Final = 0.075  # m; what is nearer has no direction
_ON_THE_SPOT: Final = 0.3  # rad; that much off its way the base turns before it drives
_EITHER_SIDE: Final = 2.2  # rad; a turn by more goes on to the side that it began to
_GAIN, _FASTEST_TURN, _BACK = 2.5, 1.0, 0.3  # 1/s, rad/s, m/s backwards


class Maneuvers:
    """Follows the cheapest way of poses, each time from the pose it is in.

    One way is followed up to its next turn or change of direction. Choosing among maneuvers by the
    costs of the poses that they lead to, interpolated between those of the grid, made the base turn
    left and right on the spot for hundreds of steps.
    """

    def __init__(self) -> None:
        """Nothing is planned."""
        self._plan: GroundPlan | None = None
        self._middle = np.zeros(2, dtype=np.int64)
        self._side = 0.0

    def choose(
        self, plan: GroundPlan, base: FloatArray, yaw: float, speed: float
    ) -> tuple[float, float]:
        """What to do now.

        Args:
            plan: Ways of a disc on the ground; poses are planned anew when it changes, or when the
                base has come half of the way to the border of their window.
            base: Position of the base, shape (2,), m.
            yaw: Its direction, rad.
            speed: Of driving ahead [m/s].

        Returns:
            Speed [m/s], negative backwards, and turn [rad/s] of the base.
        """
        cells = (base - plan.offset) / CELL
        if plan is not self._plan or np.abs(cells - self._middle).max() > WINDOW // 4:
            self._plan, self._middle = plan, cells.astype(np.int64)
            i, j = map(int, self._middle)
            first = (i - WINDOW // 2, j - WINDOW // 2)
            self._costs = pose_costs(plan.low, plan.high, plan.ends, plan.cost, first)
        x, y = cells - self._middle + WINDOW // 2
        return self._follow(pose_path(self._costs, x, y, yaw), np.array([x, y]), yaw, speed)

    def _follow(
        self, path: PosePath, place: FloatArray, yaw: float, speed: float
    ) -> tuple[float, float]:
        """Turn on the spot, or drive the straight run that comes first."""
        turns = path.turns
        off = _wrapped(path.yaws[turns] - yaw)
        if turns == len(path.moves) or abs(off) > _ON_THE_SPOT:
            return 0.0, self._turn_by(off)
        self._side = 0.0
        ahead = path.moves[turns] == AHEAD
        away = path.run(turns, _LOOK_AHEAD / CELL) - place
        if np.hypot(*away) * CELL > _AT:
            off = _wrapped(np.arctan2(away[1], away[0]) - yaw - (0.0 if ahead else np.pi))
        speed = (speed if ahead else -_BACK) * max(0.0, float(np.cos(off))) ** 4
        return speed, float(np.clip(_GAIN * off, -_FASTEST_TURN, _FASTEST_TURN))

    def _turn_by(self, off: float) -> float:
        """Turn on the spot [rad/s] by an angle [rad], either way around where that is level."""
        side = self._side if self._side and abs(off) > _EITHER_SIDE else float(np.sign(off))
        self._side = side
        return side * min(_GAIN * abs(off), _FASTEST_TURN)


def _wrapped(angle: float) -> float:
    """The same angle in [-pi, pi) [rad]."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)
