"""Space that a goal tells to be free, although nobody has seen it.

Not in the paper. The gripper can be where it shall be, so nothing else is there: a robot that is
sent to a place behind the edge of a table need not take the unseen space there for occupied.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from horf_env.types import FloatArray

RADIUS: Final = 0.16
"""Of the capsule around hand and fingers [m]: half the width of the hand, and the margin."""

LENGTH: Final = 0.35
"""Of its axis [m]: from the goal back along the approach, past the wrist."""

_SPACING = 0.04  # m between points: less than a voxel


def goal_space(T_world_goal: FloatArray) -> FloatArray:
    """Points that fill a capsule around the hand at its goal.

    Args:
        T_world_goal: Pose of the end effector at the goal, shape (4, 4).

    Returns:
        In the world, shape (N, 3), m.
    """
    across = np.arange(-RADIUS, RADIUS + 1e-9, _SPACING)
    along = np.arange(-LENGTH - RADIUS, RADIUS + 1e-9, _SPACING)
    grid = np.stack(np.meshgrid(across, across, along, indexing="ij"), axis=-1).reshape(-1, 3)
    beyond = grid[:, 2] - np.clip(grid[:, 2], -LENGTH, 0.0)
    inside = np.hypot(np.hypot(grid[:, 0], grid[:, 1]), beyond) <= RADIUS
    points: FloatArray = T_world_goal[:3, 3] + grid[inside] @ T_world_goal[:3, :3].T
    return points
