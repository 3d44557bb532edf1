"""Jacobians of all bodies from those of the joints, compiled: one call instead of thirty."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray


@njit(cache=True)
def shifted_jacobians(
    joints: FloatArray, rates: FloatArray, moves: FloatArray, origins: FloatArray
) -> FloatArray:
    """Jacobians (linear; angular) in world axes, each taken at a point of its own.

    Args:
        joints: Velocity at the origin of the world for each joint, shape (6, m).
        rates: Joint rates for each velocity, shape (m, n).
        moves: 1 where a velocity moves a body, else 0, shape (B, n).
        origins: Where each body's Jacobian is taken, shape (B, 3), m.

    Returns:
        Shape (B, 6, n).
    """
    n_bodies, n = moves.shape
    world = np.zeros((6, n))
    for row in range(6):
        for m in range(len(rates)):
            for j in range(n):
                world[row, j] += joints[row, m] * rates[m, j]
    result = np.empty((n_bodies, 6, n))
    for b in range(n_bodies):
        x, y, z = origins[b, 0], origins[b, 1], origins[b, 2]
        for j in range(n):
            wx, wy, wz = world[3, j], world[4, j], world[5, j]
            on = moves[b, j]
            result[b, 0, j] = on * (world[0, j] + wy * z - wz * y)
            result[b, 1, j] = on * (world[1, j] + wz * x - wx * z)
            result[b, 2, j] = on * (world[2, j] + wx * y - wy * x)
            result[b, 3, j], result[b, 4, j], result[b, 5, j] = on * wx, on * wy, on * wz
    return result
