"""The oracle's way of driving and reaching, with the robot's own map in place of the true scene.

Not in the paper. It knows nothing that a policy could not know: what the camera has shown, the goal
and its own joints.
"""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from horf_env.perception import Guide
from horf_env.planners.giving_way import GivingWay
from horf_env.planners.oracle import KnownEnv, OraclePlanner
from horf_env.records import StepRecord
from horf_env.robot.footprint import CARRIED_HEIGHT
from horf_env.types import FloatArray

# On a tighter turn the inner side of the base sweeps ground that a camera on its front, 87 degrees
# wide, does not see. 1.75 m would show all of it, and is too wide for a forest.
_TURNING_RADIUS = 1.2  # m
_SHARP, _STANDING = 1.0, 0.15  # rad/s, m/s; a sharper turn is done standing
_GIVING_WAY = 0.3  # m/s, backwards
_BLOCK_HEIGHT = 0.2  # m; a place that is to be avoided counts as an obstacle for the base


class MappedRoute:
    """Ways on the ground that the robot has seen."""

    def __init__(self, env: KnownEnv) -> None:
        """Start without anything to avoid.

        Args:
            env: Gives the robot's state and known obstacle points.
        """
        self._env = env
        self._guide = Guide(env.T_world_goal, env.record.state.T_world_base[:2, 3])
        self._avoided = np.empty((0, 3))
        self._record: StepRecord | None = None

    def ahead(self, position: FloatArray, distance: float) -> tuple[FloatArray, float]:
        """Point on the way from where the base is, at most 0.8 m ahead; see `Route.ahead`."""
        view, T = self._view(), self._env.record.state.T_world_base
        along = view[9:11] * min(distance / max(float(view[11]), 1e-9), 1.0)
        return T[:2, 3] + T[:2, :2] @ along, min(float(view[11]), distance)

    def cost(self, position: FloatArray) -> float:
        """Of the way from where the base is to the goal, as if all had been known [m]."""
        return float(self._view()[12]) - self._guide.ways.surprises

    def clearance(self, position: FloatArray) -> float:
        """Least distance of a base centre (2,) to known obstacles, seen from above [m]."""
        points = self._env.record.points
        near = points[points[:, 2] < CARRIED_HEIGHT, :2] - position
        return float(np.sqrt((near**2).sum(axis=1).min(initial=np.inf)))

    def discourage(self, position: FloatArray) -> None:
        """Take a place (2,) [m] for blocked."""
        self._avoided = np.vstack([self._avoided, [*position, _BLOCK_HEIGHT]])

    def _view(self) -> FloatArray:
        if self._env.record is not self._record:
            self._record = self._env.record
            points = np.concatenate([self._record.points, self._avoided])
            self._latest = self._guide.view(points, self._record.state.T_world_base)
        return self._latest


class MappedPlanner(OraclePlanner):
    """Shortest way on the own map, then the oracle's approach."""

    def reset(self, env: gym.Env[dict[str, np.ndarray], FloatArray]) -> None:
        """See `Planner`."""
        super().reset(env)
        self._giving_way = GivingWay()

    def _plan(self, env: KnownEnv) -> MappedRoute:
        return MappedRoute(env)

    def _steer(self, speed: float, turn: float) -> tuple[float, float]:
        """Wide turns, or turns on the spot; backwards where neither is possible."""
        assert self._env is not None
        command = self._env.record.command
        velocity = command.velocity[:2] if command else np.zeros(2)
        speed = 0.0 if abs(turn) > _SHARP else speed
        if self._giving_way.update(speed, velocity):
            return -_GIVING_WAY, 0.0  # on ground that it came over
        now = abs(float(velocity[0]))
        sharpest = np.inf if now < _STANDING else now / _TURNING_RADIUS
        return speed, float(np.clip(turn, -sharpest, sharpest))
