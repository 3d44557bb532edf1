"""The oracle's way of driving and reaching, with the robot's own map in place of the true scene.

Not in the paper. It knows nothing that a policy could not know: what the camera has shown, the goal
and its own joints.
"""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from horf_env.perception import GroundPlan
from horf_env.planners.allowed_motion import allowed_motion
from horf_env.planners.carrying import ARM_TUCKED
from horf_env.planners.giving_way import GivingWay
from horf_env.planners.maneuvers import Maneuvers
from horf_env.planners.oracle import KnownEnv, OraclePlanner
from horf_env.robot import RobotState
from horf_env.robot.footprint import CARRIED_HEIGHT
from horf_env.types import FloatArray

# On a tighter turn the inner side of the base sweeps ground that a camera on its front, 87 degrees
# wide, does not see. 1.75 m would show all of it, and is too wide for a forest.
_TURNING_RADIUS = 1.2  # m
_SHARP, _STANDING = 1.0, 0.15  # rad/s, m/s; a sharper turn is done standing
_GIVING_WAY = 0.3  # m/s
_ROOMY = 0.8  # m; with less to the next obstacle the base is no disc any more
_CAUTION = 0.05  # m of clearance that it takes off when it chooses its speed there
_PRESUMED = 0.3  # m behind surfaces, while it turns to the goal; see `MappedPlanner`


class MappedRoute:
    """Ways on the ground that the robot has seen."""

    def __init__(self, env: KnownEnv) -> None:
        """Start without anything to avoid.

        Args:
            env: Gives the robot's state, known obstacle points and the way.
        """
        self._env, self._ways = env, env.guide.ways

    @property
    def plan(self) -> GroundPlan:
        """The last plan."""
        return self._ways.plan

    def ahead(self, position: FloatArray, distance: float) -> tuple[FloatArray, float]:
        """Point on the way from where the base is, at most 0.8 m ahead; see `Route.ahead`."""
        view, T = self._env.hints, self._env.record.state.T_world_base
        along = view[9:11] * min(distance / max(float(view[11]), 1e-9), 1.0)
        return T[:2, 3] + T[:2, :2] @ along, min(float(view[11]), distance)

    def cost(self, position: FloatArray) -> float:
        """Of the way from where the base is to the goal, as if all had been known [m]."""
        return float(self._env.hints[12]) - self._ways.surprises

    def clearance(self, position: FloatArray) -> float:
        """Least distance of a base centre (2,) to known obstacles, seen from above [m]."""
        points = self._env.record.points
        near = points[points[:, 2] < CARRIED_HEIGHT, :2] - position
        return float(np.sqrt((near**2).sum(axis=1).min(initial=np.inf)))

    def discourage(self, position: FloatArray) -> None:
        """Take a place (2,) [m] for blocked."""
        self._ways.avoid(position)


class MappedPlanner(OraclePlanner):
    """Shortest way on the own map, then the oracle's approach.

    It has the map presume nothing behind surfaces: for somebody who plans ways around them that
    closes more than it guards. Only where it turns to the goal the arm, as it unfolds, swings
    around things whose other sides nobody has seen.
    """

    def __init__(self, carry: FloatArray = ARM_TUCKED) -> None:
        """Do nothing before `reset`.

        Args:
            carry: See `OraclePlanner`.
        """
        super().__init__(carry)

    def reset(self, env: gym.Env[dict[str, np.ndarray], FloatArray]) -> None:
        """See `Planner`."""
        super().reset(env)
        self._giving_way, self._maneuvers = GivingWay(), Maneuvers()

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """See `Planner`."""
        action = super().act(observation)
        assert self._env is not None
        self._env.space.presume(_PRESUMED if self._stage == "turn" else 0.0)
        return action

    def _plan(self, env: KnownEnv) -> MappedRoute:
        self._mapped = MappedRoute(env)
        return self._mapped

    def _drive(self, state: RobotState, target: FloatArray) -> FloatArray:
        """With maneuvers where there is little room; see the oracle elsewhere."""
        T = state.T_world_base
        room = self._mapped.clearance(T[:2, 3])
        if room > _ROOMY:
            return super()._drive(state, target)
        yaw = float(np.arctan2(T[1, 0], T[0, 0]))
        chosen = self._maneuvers.choose(
            self._mapped.plan, T[:2, 3], yaw, self._speed(room - _CAUTION)
        )
        return self._carried(state, *self._unless_held(*chosen))

    def _carried(self, state: RobotState, speed: float, turn: float) -> FloatArray:
        """With what the QP lets through of it."""
        assert self._env is not None
        points, braking = self._env.record.points, self._env.limits.braking
        allowed = allowed_motion(points, state.T_world_base, speed, turn, braking)
        return super()._carried(state, *allowed)

    def _steer(self, speed: float, turn: float) -> tuple[float, float]:
        """Wide turns, or turns on the spot."""
        speed = 0.0 if abs(turn) > _SHARP else speed
        now = abs(float(self._velocity()[0]))
        sharpest = np.inf if now < _STANDING else now / _TURNING_RADIUS
        return self._unless_held(speed, float(np.clip(turn, -sharpest, sharpest)))

    def _unless_held(self, speed: float, turn: float) -> tuple[float, float]:
        """The same, or straight out of the way where neither is possible."""
        direction = self._giving_way.update(max(speed, 0.0), self._velocity())
        return (direction * _GIVING_WAY, 0.0) if direction else (speed, turn)

    def _velocity(self) -> FloatArray:
        """Of the base in the last step, shape (2,), m/s and rad/s."""
        assert self._env is not None
        command = self._env.record.command
        return command.velocity[:2] if command else np.zeros(2)
