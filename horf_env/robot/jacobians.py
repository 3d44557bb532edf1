"""Poses and Jacobians of all bodies from what Pinocchio gives: one call instead of thirty."""

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


@njit(cache=True)
def poses_and_jacobians(
    rotations: tuple[FloatArray, ...],
    translations: tuple[FloatArray, ...],
    joints: FloatArray,
    rates: FloatArray,
    moves: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Poses of all bodies, and their Jacobians at the origins of their frames.

    Args:
        rotations: Of each body, shape (3, 3).
        translations: Of each body, shape (3,), m.
        joints: See `shifted_jacobians`.
        rates: See `shifted_jacobians`.
        moves: See `shifted_jacobians`.

    Returns:
        Shapes (B, 4, 4) and (B, 6, n).
    """
    poses = np.zeros((len(moves), 4, 4))
    for b in range(len(moves)):
        rotation, translation = rotations[b], translations[b]
        for i in range(3):
            for j in range(3):
                poses[b, i, j] = rotation[i, j]
            poses[b, i, 3] = translation[i]
        poses[b, 3, 3] = 1.0
    return poses, shifted_jacobians(joints, rates, moves, poses[:, :3, 3])
