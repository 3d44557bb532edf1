"""Points that ride on bodies, compiled: one call for all bodies."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray, IntArray


@njit(cache=True)
def placed_points(points: FloatArray, starts: IntArray, poses: FloatArray) -> FloatArray:
    """Points of several bodies in the world.

    Args:
        points: Points of all bodies, each in its body's frame, shape (N, 3), m.
        starts: First point of each body, and the number of all, shape (B + 1,).
        poses: T_world_body, shape (B, 4, 4).

    Returns:
        Shape (N, 3), m.
    """
    placed = np.empty(points.shape)
    for b in range(len(poses)):
        T = poses[b]
        for i in range(starts[b], starts[b + 1]):
            x, y, z = points[i]
            for j in range(3):
                placed[i, j] = T[j, 0] * x + T[j, 1] * y + T[j, 2] * z + T[j, 3]
    return placed
