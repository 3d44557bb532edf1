"""Voxels around the robot in preallocated arrays, and the compiled functions that change them.

A window of columns follows the robot. Column (x, y) of the world lives at (x mod C, y mod C), so
nothing is moved when the window is. Along z a column is one 64-bit word a property, so that
questions about a whole column are a few bit operations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from horf_env.types import FloatArray

_MOST_LAYERS = 63  # bits of a word less one, which marks the columns that the base has covered


BIT = np.uint64(1)
COVERED = np.uint64(1 << 63)
"""Bit of a column where the base has stood: free, but nothing is known about what is beside it."""


class VoxelGrid(NamedTuple):
    """The arrays. C columns a side (a power of two), Z layers, room for N occupied voxels.

    Compiled functions take an array out before a loop, not in it: that counts references, which
    costs more than what is done with a voxel.

    Attributes:
        size: Edge of a voxel [m], shape (1,).
        first: World numbers of the window's first column, shape (2,).
        seen: Layers that a ray has passed or the base has covered, bits, shape (C, C).
        occupied: Layers with a surface point, bits, shape (C, C).
        hidden: Layers that were behind a surface when the robot saw it, bits, shape (C, C).
        place: Where an occupied voxel's point is in the lists below, -1 for none; (C, C, Z).
        length: Length of the lists, shape (1,).
        point: Surface point in the world [m], shape (N, 3).
        voxel: The voxel's place in the window, shape (N, 3).
        error: Expected square distance of the point from the ideal one [m^2], shape (N,).
        misses: Frames in a row that saw through the point, shape (N,).
        time: When the voxel was last hit [s], shape (N,).
    """

    size: np.ndarray
    first: np.ndarray
    seen: np.ndarray
    occupied: np.ndarray
    hidden: np.ndarray
    place: np.ndarray
    length: np.ndarray
    point: np.ndarray
    voxel: np.ndarray
    error: np.ndarray
    misses: np.ndarray
    time: np.ndarray


def empty_grid(size: float, columns: int, layers: int) -> VoxelGrid:
    """A grid in which nothing has been seen.

    Raises:
        ValueError: If the number of columns is no power of two or there are too many layers.
    """
    if columns < 2 or columns & (columns - 1):
        raise ValueError(f"columns: expected a power of two, got {columns}")
    if not 1 <= layers <= _MOST_LAYERS:
        raise ValueError(f"layers: expected 1 to {_MOST_LAYERS}, got {layers}")
    n = columns * columns * layers
    return VoxelGrid(
        size=np.array([size]),
        first=np.full(2, -columns // 2, dtype=np.int64),
        seen=np.zeros((columns, columns), dtype=np.uint64),
        occupied=np.zeros((columns, columns), dtype=np.uint64),
        hidden=np.zeros((columns, columns), dtype=np.uint64),
        place=np.full((columns, columns, layers), -1, dtype=np.int32),
        length=np.zeros(1, dtype=np.int64),
        # Memory that is never written is never taken from the system: most of this is not.
        point=np.empty((n, 3), dtype=np.float32),
        voxel=np.empty((n, 3), dtype=np.int32),
        error=np.empty(n, dtype=np.float32),
        misses=np.empty(n, dtype=np.uint8),
        time=np.empty(n, dtype=np.float32),
    )


@njit(cache=True)
def bit(layer: int) -> np.uint64:
    """The bit of a layer."""
    return BIT << np.uint64(layer)


@njit(cache=True)
def forget(grid: VoxelGrid, entry: int) -> None:
    """Take a point out of the lists; the last one takes its place."""
    x, y, z = grid.voxel[entry, 0], grid.voxel[entry, 1], grid.voxel[entry, 2]
    grid.place[x, y, z] = -1
    grid.occupied[x, y] &= ~bit(z)
    last = grid.length[0] - 1
    grid.length[0] = last
    if entry == last:
        return
    for j in range(3):
        grid.point[entry, j] = grid.point[last, j]
        grid.voxel[entry, j] = grid.voxel[last, j]
    grid.error[entry], grid.misses[entry] = grid.error[last], grid.misses[last]
    grid.time[entry] = grid.time[last]
    grid.place[grid.voxel[entry, 0], grid.voxel[entry, 1], grid.voxel[entry, 2]] = entry


@njit(cache=True)
def move_window(grid: VoxelGrid, x: float, y: float, since: float) -> None:
    """Centre the window on (x, y) [m]; forget what leaves it or was last hit before `since` [s]."""
    n, size = len(grid.seen), grid.size[0]
    old_x, old_y = grid.first[0], grid.first[1]
    new_x, new_y = int(np.floor(x / size)) - n // 2, int(np.floor(y / size)) - n // 2
    # A column is new if its world number was not in the old window.
    for c in range(new_x, new_x + n):
        if not old_x <= c < old_x + n:
            grid.seen[c & (n - 1), :] = 0
            grid.hidden[c & (n - 1), :] = 0
    for c in range(new_y, new_y + n):
        if not old_y <= c < old_y + n:
            grid.seen[:, c & (n - 1)] = 0
            grid.hidden[:, c & (n - 1)] = 0
    grid.first[0], grid.first[1] = new_x, new_y
    for entry in range(grid.length[0] - 1, -1, -1):
        column_x = int(np.floor(grid.point[entry, 0] / size)) - new_x
        column_y = int(np.floor(grid.point[entry, 1] / size)) - new_y
        inside = 0 <= column_x < n and 0 <= column_y < n
        if not inside or grid.time[entry] < since:
            forget(grid, entry)


@njit(cache=True)
def near_points(
    grid: VoxelGrid, x: float, y: float, near: float, far: float, out: FloatArray
) -> int:
    """Write all points within `near` of (x, y) and every second one up to `far` [m].

    Every second: those of the voxels that are one colour of a three-dimensional chessboard, so
    that a thin post keeps half of its points.

    Returns:
        How many were written.
    """
    found, room, point, voxel = 0, len(out), grid.point, grid.voxel
    for entry in range(grid.length[0]):
        dx, dy = point[entry, 0] - x, point[entry, 1] - y
        squared = dx * dx + dy * dy
        if squared > far * far or found == room:
            continue
        colour = voxel[entry, 0] + voxel[entry, 1] + voxel[entry, 2]
        if squared <= near * near or colour & 1:
            for j in range(3):
                out[found, j] = point[entry, j]
            found += 1
    return found
