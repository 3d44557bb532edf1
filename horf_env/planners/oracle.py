"""Reference that knows the scene: drives the shortest way, then reaches along the approach.

No competitor of the methods, which see what the camera has shown: it tells how much of a task the
action layer can do if somebody knows the way, and it gives demonstrations for training.
"""

from __future__ import annotations

from typing import Protocol, cast

import gymnasium as gym
import numpy as np

from horf_env.control import deviation, servo_twist
from horf_env.planners.route import Route
from horf_env.records import StepRecord
from horf_env.robot import LimitsProfile, RobotState
from horf_env.scenes import Scene
from horf_env.types import FloatArray

_LOOK_AHEAD, _ARRIVED, _FACING = 0.8, 0.2, 0.15  # m of way, m of way, rad
_LEAVE = 1.6  # m from the goal; farther away it drives again
_CARRIED = np.array([0.55, 0.0, 0.85])  # m; where the gripper is held while driving, in base axes
_CARRY_GAIN, _TURN_GAIN, _FASTEST_TURN = 1.5, 2.0, 1.2  # 1/s, 1/s, rad/s
_SLOWEST, _FASTEST, _SPEED_GAIN, _TIGHT = 0.3, 1.2, 1.2, 0.4  # m/s, m/s, 1/s, m of clearance
# The gripper first goes to a place this far before the goal [m], and on once it is in line.
_BEFORE, _IN_LINE, _TURNED, _OUT_OF_LINE = 0.25, 0.04, 0.15, 0.12  # m, m, rad, m
_REACH_SPEED = 0.6  # m/s


class KnownEnv(Protocol):
    """What the oracle is told beside the observation."""

    scene: Scene
    limits: LimitsProfile
    record: StepRecord
    T_world_goal: FloatArray


class OraclePlanner:
    """Shortest way on the true scene, then a servo in two stages."""

    action_layer = "sdf_qp"

    def __init__(self) -> None:
        self._env: KnownEnv | None = None

    def reset(self, env: gym.Env[dict[str, np.ndarray], FloatArray]) -> None:
        """See `Planner`."""
        self._env = cast(KnownEnv, env.unwrapped)
        self._route = Route(self._env.scene)
        self._goal = self._env.T_world_goal
        self._scale = self._env.limits.twist_scale
        self._stage = "drive"

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """See `Planner`.

        Raises:
            RuntimeError: If `reset` was not called.
        """
        if self._env is None:
            raise RuntimeError("call reset(env) before act(observation)")
        state = self._env.record.state
        target, length = self._route.ahead(state.T_world_base[:2, 3], _LOOK_AHEAD)
        self._change_stage(state, length)
        if self._stage == "drive":
            twist = self._drive(state, target, _FASTEST)
        elif self._stage == "turn":
            twist = self._drive(state, self._goal[:2, 3], 0.0)
        else:
            twist = self._reach(state)
        return np.clip(twist / self._scale, -1.0, 1.0)

    def _change_stage(self, state: RobotState, length: float) -> None:
        """Drive until the way ends, face the goal, get in line, approach; back if that fails."""
        offset = self._goal[:3, 3] - state.T_world_ee[:3, 3]
        axis = self._goal[:3, 2]
        beside = float(np.linalg.norm(offset - (offset @ axis) * axis))
        turn = np.linalg.norm(deviation(state.T_world_ee, self._goal, np.eye(3))[3:])
        if np.linalg.norm(self._goal[:2, 3] - state.T_world_base[:2, 3]) > _LEAVE:
            self._stage = "drive"
        elif self._stage == "drive" and length < _ARRIVED:
            self._stage = "turn"
        if self._stage == "turn" and abs(_bearing(state, self._goal[:2, 3])) < _FACING:
            self._stage = "align"
        if self._stage == "align" and beside < _IN_LINE and turn < _TURNED:
            self._stage = "approach"
        elif self._stage == "approach" and beside > _OUT_OF_LINE:
            self._stage = "align"

    def _drive(self, state: RobotState, target: FloatArray, fastest: float) -> FloatArray:
        """Twist of a gripper that is carried by a base which goes to a point (2,) [m]."""
        R, base = state.T_world_base[:3, :3], state.T_world_base[:3, 3]
        bearing = _bearing(state, target)
        gripper = R.T @ (state.T_world_ee[:3, 3] - base)
        room = self._route.clearance(base[:2]) - _TIGHT
        speed = min(fastest, max(_SLOWEST, _SLOWEST + _SPEED_GAIN * room))
        speed *= max(0.0, np.cos(bearing)) ** 4  # turn first
        turn = np.clip(_TURN_GAIN * bearing, -_FASTEST_TURN, _FASTEST_TURN)
        twist = np.zeros(6)
        twist[:3] = _CARRY_GAIN * (_CARRIED - gripper)
        twist[:2] += [speed - turn * gripper[1], turn * gripper[0]]
        twist[5] = turn
        return twist

    def _reach(self, state: RobotState) -> FloatArray:
        """Twist towards the goal, or towards the place before it."""
        target = self._goal.copy()
        if self._stage == "align":
            target[:3, 3] -= _BEFORE * target[:3, 2]
        error = deviation(state.T_world_ee, target, state.T_world_base[:3, :3])
        twist = servo_twist(error, self._scale)
        speed = np.linalg.norm(twist[:3])
        twist[:3] *= min(1.0, _REACH_SPEED / max(float(speed), 1e-9))
        return twist


def _bearing(state: RobotState, target: FloatArray) -> float:
    """Direction of a point (2,) [m] as the base sees it [rad]."""
    R, base = state.T_world_base[:2, :2], state.T_world_base[:2, 3]
    ahead, left = R.T @ (target - base)
    return float(np.arctan2(left, ahead))
