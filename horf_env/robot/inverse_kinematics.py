"""Arm joints that bring the end effector to a pose, by damped least squares."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from horf_env.robot import MobileManipulator
from horf_env.robot.limits import ARM_LOWER, ARM_UPPER
from horf_env.types import FloatArray

_DAMPING = 0.05
"""Damping of the step: small against the singular values of a well bent arm."""

_ITERATIONS = 25
"""Seeds that lead to a solution need about 10."""
_POSITION_TOLERANCE, _ANGLE_TOLERANCE = 1e-3, 5e-3  # m and rad: far inside the task's own
_MAX_STEP = 0.5  # rad per joint and iteration


def arm_ik(
    robot: MobileManipulator, base: FloatArray, T_goal: FloatArray, seed: FloatArray
) -> FloatArray | None:
    """Joint angles (7,) within their limits for a base pose (3,), or None if the seed fails."""
    arm = seed.copy()
    for _ in range(_ITERATIONS):
        state = robot.state(np.concatenate([base, arm]))
        error = pose_error(state.T_world_base, state.T_world_ee, T_goal)
        if (
            np.linalg.norm(error[:3]) < _POSITION_TOLERANCE
            and np.linalg.norm(error[3:]) < _ANGLE_TOLERANCE
        ):
            return arm
        J = state.ee_jacobian[:, 2:]
        step = J.T @ np.linalg.solve(J @ J.T + _DAMPING**2 * np.eye(6), error)
        arm = np.clip(arm + np.clip(step, -_MAX_STEP, _MAX_STEP), ARM_LOWER, ARM_UPPER)
    return None


def pose_error(T_world_base: FloatArray, T_world_ee: FloatArray, T_goal: FloatArray) -> FloatArray:
    """Twist (6,) in the axes of the base that leads to the goal in one unit of time."""
    R_base = T_world_base[:3, :3]
    turn = Rotation.from_matrix(T_goal[:3, :3] @ T_world_ee[:3, :3].T).as_rotvec()
    error = np.concatenate([R_base.T @ (T_goal[:3, 3] - T_world_ee[:3, 3]), R_base.T @ turn])
    return error
