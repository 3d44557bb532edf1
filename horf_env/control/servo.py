"""Position-based servo: the EE twist that points straight at the goal."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from horf_env.types import FloatArray

POSITION_GAIN = 1.5  # 1/s, as in Haviland's holistic controller
ROTATION_GAIN = 1.3 * POSITION_GAIN  # 1/s, the same source turns 1.3 times as eagerly
_GAINS = np.repeat([POSITION_GAIN, ROTATION_GAIN], 3)


def deviation(T_world_ee: FloatArray, T_world_goal: FloatArray, R_base: FloatArray) -> FloatArray:
    """Deviation of the end effector from the goal (s_dev in the paper).

    Args:
        T_world_ee: Pose of the end effector, shape (4, 4).
        T_world_goal: Pose of the goal, shape (4, 4).
        R_base: Axes of the base in the world, shape (3, 3).

    Returns:
        Position error [m] and rotation vector [rad] from end effector to goal, in the axes of the
        base; shape (6,).
    """
    position = R_base.T @ (T_world_goal[:3, 3] - T_world_ee[:3, 3])
    turn = pin.log3(T_world_goal[:3, :3] @ T_world_ee[:3, :3].T)
    return np.concatenate([position, R_base.T @ turn])


def servo_twist(deviation: FloatArray, twist_scale: FloatArray) -> FloatArray:
    """Proportional twist towards the goal, slowed down to what an action can ask for.

    Linear and angular part each keep their direction: the deviation from Haviland's servo, which
    scales the joint velocities after the QP and so lets the base crawl far from the goal.

    Args:
        deviation: As returned by `deviation`, shape (6,).
        twist_scale: Twist of a full action, shape (6,), m/s and rad/s.

    Returns:
        Twist in the axes of the base, shape (6,), m/s and rad/s.
    """
    twist = _GAINS * deviation
    actions = np.abs(twist) / twist_scale
    twist[:3] /= max(1.0, actions[:3].max())
    twist[3:] /= max(1.0, actions[3:].max())
    return twist
