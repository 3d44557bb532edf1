"""Fewer points for the same surface: overlapping frames show everything several times."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray, IntArray

# Multipliers that spread the voxels' numbers over the table (large primes, as is usual).
_PRIMES = (73856093, 19349663, 83492791)
_OFFSET = 1 << 20  # makes voxel numbers positive up to a million voxels from the origin


def thin(points: FloatArray, voxel: float) -> FloatArray:
    """The first point of each occupied voxel, unmoved and in the order of the input.

    Args:
        points: Shape (N, 3), m; put first what shall be kept.
        voxel: Edge of a voxel [m].

    Returns:
        Shape (M, 3), m, M <= N.
    """
    if len(points) == 0:
        return points
    size = 1 << int(np.ceil(np.log2(2 * len(points) + 1)))
    keep = np.zeros(len(points), dtype=np.bool_)
    _mark_first(points, 1.0 / voxel, np.full(size, -1, dtype=np.int64), keep)
    return points[keep]


def ring(points: FloatArray, centre: FloatArray, inner: float, outer: float) -> FloatArray:
    """Points whose horizontal distance from the centre is between two radii [m].

    Args:
        points: Shape (N, 3), m.
        centre: Shape (2,), m.
        inner: Least distance [m], included.
        outer: Greatest distance [m], excluded.
    """
    x, y = points[:, 0] - centre[0], points[:, 1] - centre[1]
    squared = x * x + y * y
    return np.compress((squared >= inner * inner) & (squared < outer * outer), points, axis=0)


@njit(cache=True)
def _mark_first(points: FloatArray, scale: float, table: IntArray, keep: np.ndarray) -> None:
    """Mark the first point of each voxel; the table is an open-addressing hash set of voxels."""
    mask = len(table) - 1
    for i in range(len(points)):
        x = int(np.floor(points[i, 0] * scale)) + _OFFSET
        y = int(np.floor(points[i, 1] * scale)) + _OFFSET
        z = int(np.floor(points[i, 2] * scale)) + _OFFSET
        name = (x << 42) | (y << 21) | z
        place = ((x * _PRIMES[0]) ^ (y * _PRIMES[1]) ^ (z * _PRIMES[2])) & mask
        while table[place] != -1 and table[place] != name:
            place = (place + 1) & mask
        if table[place] == -1:
            table[place] = name
            keep[i] = True
