"""How a gripper is carried: twists that leave the base to the planner and the arm to its posture.

The action is a twist of the end effector, and a twist alone does not say what the base does. This
one does: it holds what the QP's objective wants of the arm anyway, the return to a posture at the
objective's own rate, so that the QP is left with the base's part.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np

from horf_env.control.posture import FASTEST_RETURN, PostureObjective
from horf_env.robot import ARM_READY, MobileManipulator, RobotState
from horf_env.robot.inverse_kinematics import arm_ik
from horf_env.types import FloatArray

ARM_TUCKED: Final = np.array([0.0, -1.3, 0.0, -2.75, 0.0, 1.4, np.pi / 4])
"""The whole arm above the base, 0.19 m behind its middle to 0.37 m before it and 1.08 m high [rad].

In the ready pose it reaches 0.67 m ahead and is 1.15 m high: in clutter the hand is the first thing
that stops the robot.
"""

_ARM_SHARE = 0.8  # of the range of twists; the rest is left for the base
_LEAST_HEIGHT = 0.8  # m; over what stands about, as in the ready pose


def carrying_twist(
    state: RobotState, posture: FloatArray, base: FloatArray, scale: FloatArray
) -> FloatArray:
    """Twist of a gripper whose arm goes to a posture while the base moves.

    Args:
        state: State of the robot.
        posture: Joints of the arm, shape (7,), rad.
        base: Speed and turn of the base, shape (2,), m/s and rad/s.
        scale: Range of twists, shape (6,), m/s and rad/s.

    Returns:
        Shape (6,), in base axes, m/s and rad/s.
    """
    joints = PostureObjective.posture_gain * (posture - state.configuration[3:])
    joints = np.clip(joints, -FASTEST_RETURN, FASTEST_RETURN)
    arm = state.ee_jacobian[:, 2:] @ joints
    arm /= max(1.0, float(np.abs(arm / scale).max()) / _ARM_SHARE)
    return np.asarray(state.ee_jacobian[:, :2] @ base + arm)


def posture_before(goal: FloatArray, base: FloatArray, distance: float) -> FloatArray:
    """Posture with the gripper before a goal, turned as the goal wants it, once the base faces it.

    Args:
        goal: Pose in the world, shape (4, 4).
        base: Position of the base, shape (2,), m.
        distance: From the goal, along its line of approach [m].

    Returns:
        Joints of the arm, shape (7,), rad; the ready pose where none is found.
    """
    place, away = goal.copy(), goal[:2, 3] - base
    place[:3, 3] -= distance * place[:3, 2]
    place[2, 3] = max(place[2, 3], _LEAST_HEIGHT)
    facing = np.array([*base, np.arctan2(away[1], away[0])])
    found = arm_ik(_robot(), facing, place, ARM_READY)
    return ARM_READY if found is None else found


@lru_cache(maxsize=1)
def _robot() -> MobileManipulator:
    return MobileManipulator.load()
