"""Reference that knows the scene: drives the shortest way, then reaches along the approach.

Where it gets no further it backs off and tries another way or another place to stand.

No competitor of the methods, which see what the camera has shown: it tells how much of a task the
action layer can do if somebody knows the way, and it gives demonstrations for training.
"""

from __future__ import annotations

from typing import Literal, Protocol, cast

import gymnasium as gym
import numpy as np

from horf_env.control import deviation, servo_twist
from horf_env.perception import Guide, SeenSpace
from horf_env.planners.carrying import carrying_twist, posture_before
from horf_env.planners.patience import Patience
from horf_env.planners.route import Route
from horf_env.records import StepRecord
from horf_env.robot import ARM_READY, LimitsProfile, RobotState
from horf_env.scenes import Scene
from horf_env.types import FloatArray

_LOOK_AHEAD, _ARRIVED, _FACING = 0.8, 0.2, 0.15  # m of way, m of way, rad
_LEAVE = 1.6  # m from the goal; farther away it drives again
_TURN_GAIN, _FASTEST_TURN, _STAND_GAIN = 2.0, 1.2, 1.5  # 1/s, rad/s, 1/s
_SLOWEST, _FASTEST, _SPEED_GAIN, _TIGHT = 0.5, 1.5, 1.5, 0.4  # m/s, m/s, 1/s, m of clearance
# The gripper goes to a place on the line of approach, the farther before the goal the less it is in
# line and turned: a funnel.
_BEFORE, _PER_BESIDE, _PER_TURN, _IN_LINE = 0.25, 4.0, 0.5, 0.02  # m, m/m, m/rad, m
_REACH_SPEED = 0.6  # m/s
_PATIENCE = 80  # steps
_PER_BEARING = 0.5  # m of way for each rad; a turn towards the way is progress, too
_BLOCKED = 0.3  # m of way ahead; what is taken for blocked where driving gets no further

Stage = Literal["drive", "turn", "reach", "back"]
_WITHOUT_END: dict[Stage, Stage] = {"turn": "reach", "back": "drive"}
"""Stages that end when they get no further, and what follows."""
_CARRYING: tuple[Stage, ...] = ("drive", "back")
_BACK_STEPS, _BACK_SPEED = 30, 0.4  # m/s


class KnownEnv(Protocol):
    """What the oracle is told beside the observation."""

    scene: Scene
    limits: LimitsProfile
    record: StepRecord
    T_world_goal: FloatArray
    space: SeenSpace
    guide: Guide
    hints: FloatArray
    posture: FloatArray


class Ways(Protocol):
    """Ways of the base to where it can reach the goal; see `Route`."""

    def ahead(self, position: FloatArray, distance: float) -> tuple[FloatArray, float]:
        """A point on the way (2,) [m], and the length of way up to it [m]."""

    def cost(self, position: FloatArray) -> float:
        """Of the way to the goal [m]."""

    def clearance(self, position: FloatArray) -> float:
        """Least distance to what base or arm could hit [m]."""

    def discourage(self, position: FloatArray) -> None:
        """Prefer ways and places to stand that are not near a place (2,) [m]."""


class OraclePlanner:
    """Shortest way on the true scene, then a servo in two stages."""

    action_layer = "sdf_qp"

    def __init__(self, carry: FloatArray = ARM_READY) -> None:
        """Do nothing before `reset`.

        Args:
            carry: Posture of the arm while the base drives, shape (7,), rad.
        """
        self._env: KnownEnv | None = None
        self._stage: Stage = "drive"
        self._carry = carry

    def reset(self, env: gym.Env[dict[str, np.ndarray], FloatArray]) -> None:
        """See `Planner`."""
        self._env = cast(KnownEnv, env.unwrapped)
        self._goal = self._env.T_world_goal
        self._route = self._plan(self._env)
        self._scale = self._env.limits.twist_scale
        self._stage, self._posture, self._stand = "drive", self._carry, np.zeros(2)
        self._patience = Patience(_PATIENCE)

    def _plan(self, env: KnownEnv) -> Ways:
        return Route(env.scene, env.T_world_goal)

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """See `Planner`.

        Raises:
            RuntimeError: If `reset` was not called.
        """
        action = self._action(patient=True)
        assert self._env is not None
        self._env.posture = self._posture if self._stage in _CARRYING else ARM_READY
        return action

    def advise(self) -> FloatArray:
        """What it would do now, while somebody else drives: it does not lose patience.

        The posture that the arm goes back to is left as it is.

        Raises:
            RuntimeError: If `reset` was not called.
        """
        return self._action(patient=False)

    def _action(self, *, patient: bool) -> FloatArray:
        if self._env is None:
            raise RuntimeError("call reset(env) before act(observation)")
        state = self._env.record.state
        if self._stage == "back" or patient:
            self._lose_patience(self._env.record)
        target, length = self._route.ahead(state.T_world_base[:2, 3], _LOOK_AHEAD)
        self._change_stage(state, length)
        return np.clip(self._twist(state, target) / self._scale, -1.0, 1.0)

    def _twist(self, state: RobotState, target: FloatArray) -> FloatArray:
        if self._stage == "drive":
            return self._drive(state, target)
        if self._stage == "turn":
            return self._face_goal(state)
        if self._stage == "back":
            return self._carried(state, -_BACK_SPEED, 0.0)
        return self._reach(state)

    def _change_stage(self, state: RobotState, length: float) -> None:
        """Drive until the way ends, face the goal, reach."""
        if self._stage == "back":
            return
        if np.linalg.norm(self._goal[:2, 3] - state.T_world_base[:2, 3]) > _LEAVE:
            self._begin("drive")
        elif self._stage == "drive" and length < _ARRIVED:
            self._begin("turn")
            self._stand = state.T_world_base[:2, 3]
            self._posture = posture_before(self._goal, self._stand, _BEFORE)
        elif self._stage == "turn" and abs(_bearing(state, self._goal[:2, 3])) < _FACING:
            self._begin("reach")

    def _lose_patience(self, record: StepRecord) -> None:
        """Where a stage gets no further: reach without turning, or back off and try elsewhere."""
        state, command = record.state, record.command
        speed = float(np.linalg.norm(command.velocity)) if command else np.inf
        if not self._patience.exhausted(self._to_go(state), speed):
            return
        if self._stage in _WITHOUT_END:
            self._begin(_WITHOUT_END[self._stage])
            return
        base = state.T_world_base[:2, 3]
        blocked = self._route.ahead(base, _BLOCKED)[0] if self._stage == "drive" else base
        self._route.discourage(blocked)
        self._begin("back")

    def _begin(self, stage: Stage) -> None:
        if stage != self._stage:
            self._stage, self._posture = stage, self._carry
            self._patience = Patience(_BACK_STEPS if stage == "back" else _PATIENCE)

    def _to_go(self, state: RobotState) -> float:
        """What the present stage still has to do: m of way, rad of turn, or both of the gripper."""
        if self._stage == "back":
            return 0.0
        if self._stage == "drive":
            base = state.T_world_base[:2, 3]
            turn = abs(_bearing(state, self._route.ahead(base, _LOOK_AHEAD)[0]))
            return self._route.cost(base) + _PER_BEARING * turn
        if self._stage == "turn":
            return abs(_bearing(state, self._goal[:2, 3]))
        error = deviation(state.T_world_ee, self._goal, np.eye(3))
        return float(np.linalg.norm(error[:3]) + np.linalg.norm(error[3:]))

    def _drive(self, state: RobotState, target: FloatArray) -> FloatArray:
        """Twist of a gripper that is carried by a base which goes to a point (2,) [m]."""
        bearing = _bearing(state, target)
        speed = self._speed(self._route.clearance(state.T_world_base[:2, 3]))
        speed *= max(0.0, np.cos(bearing)) ** 4  # turn first
        return self._carried(state, *self._steer(speed, _turn_by(bearing)))

    def _speed(self, clearance: float) -> float:
        """Of driving ahead where obstacles are so far away [m/s]."""
        return min(_FASTEST, max(_SLOWEST, _SLOWEST + _SPEED_GAIN * (clearance - _TIGHT)))

    def _face_goal(self, state: RobotState) -> FloatArray:
        """Twist of a gripper whose base turns towards the goal and stays where it stands.

        Left alone it drifts by up to a metre: for the QP the base is cheaper than the arm.
        """
        turn = _turn_by(_bearing(state, self._goal[:2, 3]))
        away = state.T_world_base[:2, 0] @ (self._stand - state.T_world_base[:2, 3])
        back = float(np.clip(_STAND_GAIN * away, -_BACK_SPEED, _BACK_SPEED))
        return self._carried(state, back, turn)

    def _steer(self, speed: float, turn: float) -> tuple[float, float]:
        """What the base does of a speed [m/s] and a turn [rad/s] at once."""
        return speed, turn

    def _carried(self, state: RobotState, speed: float, turn: float) -> FloatArray:
        """Twist of the gripper while the base drives [m/s] and turns [rad/s]."""
        return carrying_twist(state, self._posture, np.array([speed, turn]), self._scale)

    def _reach(self, state: RobotState) -> FloatArray:
        """Twist towards the goal through the funnel before it."""
        target, axis = self._goal.copy(), self._goal[:3, 2]
        offset = target[:3, 3] - state.T_world_ee[:3, 3]
        beside = float(np.linalg.norm(offset - (offset @ axis) * axis))
        turn = float(np.linalg.norm(deviation(state.T_world_ee, target, np.eye(3))[3:]))
        before = _PER_BESIDE * max(beside - _IN_LINE, 0.0) + _PER_TURN * turn
        target[:3, 3] -= min(before, _BEFORE) * axis
        error = deviation(state.T_world_ee, target, state.T_world_base[:3, :3])
        twist = servo_twist(error, self._scale)
        speed = np.linalg.norm(twist[:3])
        twist[:3] *= min(1.0, _REACH_SPEED / max(float(speed), 1e-9))
        return twist


def _turn_by(bearing: float) -> float:
    """Turn of the base [rad/s] towards what it sees in a direction [rad]."""
    return float(np.clip(_TURN_GAIN * bearing, -_FASTEST_TURN, _FASTEST_TURN))


def _bearing(state: RobotState, target: FloatArray) -> float:
    """Direction of a point (2,) [m] as the base sees it [rad]."""
    R, base = state.T_world_base[:2, :2], state.T_world_base[:2, 3]
    ahead, left = R.T @ (target - base)
    return float(np.arctan2(left, ahead))
