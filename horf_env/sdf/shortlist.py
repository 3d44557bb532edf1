"""The few points of a cloud that can still matter to a body, written in its frame, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.polytope import FAST
from horf_env.sdf.scan import CHUNK
from horf_env.types import FloatArray, IntArray


@njit(cache=True)
def shortlist(values: np.ndarray, minima: np.ndarray, limit: float, indices: IntArray) -> int:
    """List the points whose value is at most a limit; whole chunks above it are passed over.

    Args:
        values: Shape (M * CHUNK,), float32.
        minima: Least value of each chunk, shape (M,).
        limit: Greatest value that is listed.
        indices: Written, shape (>= M * CHUNK,).

    Returns:
        How many points are listed.
    """
    found, most = 0, np.float32(limit)
    for chunk in range(len(minima)):
        if minima[chunk] > most:
            continue
        for i in range(chunk * CHUNK, (chunk + 1) * CHUNK):
            indices[found] = i
            found += values[i] <= most
    return found


@njit(cache=True, fastmath=FAST)
def localise(points: FloatArray, pose: FloatArray, indices: IntArray, local: FloatArray) -> None:
    """Write the listed points in the frame of a body, coordinates apart.

    Args:
        points: Cloud in the world, shape (N, 3), m.
        pose: T_world_body, shape (4, 4).
        indices: The list, shape (L,).
        local: Written, shape (3, >= L), m.
    """
    r00, r01, r02, t0 = pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3]
    r10, r11, r12, t1 = pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3]
    r20, r21, r22, t2 = pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3]
    for m in range(len(indices)):
        i = indices[m]
        dx, dy, dz = points[i, 0] - t0, points[i, 1] - t1, points[i, 2] - t2
        local[0, m] = r00 * dx + r10 * dy + r20 * dz
        local[1, m] = r01 * dx + r11 * dy + r21 * dz
        local[2, m] = r02 * dx + r12 * dy + r22 * dz


@njit(cache=True, fastmath=FAST)
def place_of_lowest(values: FloatArray) -> int:
    """Index of the least of some numbers, the first of equal ones."""
    lowest = values[0]
    for i in range(len(values)):
        lowest = min(lowest, values[i])
    place = 0
    while values[place] > lowest:
        place += 1
    return place
