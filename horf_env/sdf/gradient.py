"""Chain rule for distances of many points at once; the compiled query has its own, one by one."""

from __future__ import annotations

from horf_env.robot import RobotState
from horf_env.robot.vectors import cross
from horf_env.types import FloatArray, IntArray


def distance_gradient(
    state: RobotState, bodies: IntArray, points: FloatArray, normals: FloatArray
) -> FloatArray:
    """Chain rule: d distance / d velocity for world-fixed points.

    The distance falls as fast as the body-fixed point under the world point moves along the normal:
    d zeta / d velocity = -normal . J_point.

    Args:
        state: State of the robot.
        bodies: Body of each row of points, shape (B,).
        points: World points, shape (B, K, 3), m.
        normals: Gradients of the distances with respect to the points, shape (B, K, 3).

    Returns:
        Shape (B, K, 9), m per (m or rad).
    """
    J = state.body_jacobians[bodies]
    arm = points - state.link_poses[bodies, None, :3, 3]
    torque = cross(arm, normals)
    return -(normals @ J[:, :3] + torque @ J[:, 3:])
