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
        # Numbers one by one: a row of points or of the pose as a view costs more than the product.
        r00, r01, r02, t0 = T[0, 0], T[0, 1], T[0, 2], T[0, 3]
        r10, r11, r12, t1 = T[1, 0], T[1, 1], T[1, 2], T[1, 3]
        r20, r21, r22, t2 = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
        for i in range(starts[b], starts[b + 1]):
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            placed[i, 0] = r00 * x + r01 * y + r02 * z + t0
            placed[i, 1] = r10 * x + r11 * y + r12 * z + t1
            placed[i, 2] = r20 * x + r21 * y + r22 * z + t2
    return placed
