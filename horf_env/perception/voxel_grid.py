"""Voxels around the robot in preallocated arrays, and the compiled functions that change them.

A window of columns follows the robot. Column (x, y) of the world lives at (x mod C, y mod C), so
nothing is moved when the window is. Along z a column is one 64-bit word a property, so that
questions about a whole column are a few bit operations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from horf_env.errors import SettingError
from horf_env.types import FloatArray

_MOST_LAYERS = 63  # bits of a word less one, which marks the columns that the base has covered


BIT = np.uint64(1)
COVERED = np.uint64(1 << 63)
"""Bit of a column where the base has stood: free, but nothing is known about what is beside it."""


SURFACE = np.dtype(
    [
        ("x", np.float32),
        ("y", np.float32),
        ("z", np.float32),
        ("error", np.float32),
        ("time", np.float32),
        ("misses", np.int32),
        ("column_x", np.int16),
        ("column_y", np.int16),
        ("layer", np.int16),
    ],
    align=True,
)
"""What is kept of an occupied voxel, side by side: one look at memory instead of six.

Its surface point in the world [m]; the expected square distance of the point from the ideal one
[m^2]; when the voxel was last hit [s]; frames in a row that saw through the point; the voxel's
place in the window.
"""


class VoxelGrid(NamedTuple):
    """The arrays. C columns a side (a power of two), Z layers, room for N occupied voxels.

    Compiled functions take an array out before a loop, not in it: that counts references, which
    costs more than what is done with a voxel.

    Attributes:
        size: Edge of a voxel [m].
        first: World numbers of the window's first column, shape (2,).
        seen: Layers that a ray has passed or the base has covered, bits, shape (C, C).
        occupied: Layers with a surface point, bits, shape (C, C).
        hidden: Layers that were behind a surface when the robot saw it, bits, shape (C, C).
        place: Where an occupied voxel is in the list below, -1 for none; shape (C, C, Z).
        length: Length of the list, shape (1,).
        surface: Occupied voxels, see `SURFACE`; shape (N,).
    """

    size: float
    first: np.ndarray
    seen: np.ndarray
    occupied: np.ndarray
    hidden: np.ndarray
    place: np.ndarray
    length: np.ndarray
    surface: np.ndarray


def empty_grid(size: float, columns: int, layers: int) -> VoxelGrid:
    """A grid in which nothing has been seen.

    Raises:
        SettingError: If the number of columns is no power of two or there are too many layers.
    """
    if columns < 2 or columns & (columns - 1):
        raise SettingError("columns", columns, "a power of two")
    if not 1 <= layers <= _MOST_LAYERS:
        raise SettingError("layers", layers, f"1 to {_MOST_LAYERS}")
    return VoxelGrid(
        size=size,
        first=np.full(2, -columns // 2, dtype=np.int64),
        seen=np.zeros((columns, columns), dtype=np.uint64),
        occupied=np.zeros((columns, columns), dtype=np.uint64),
        hidden=np.zeros((columns, columns), dtype=np.uint64),
        place=np.full((columns, columns, layers), -1, dtype=np.int32),
        length=np.zeros(1, dtype=np.int64),
        # Memory that is never written is never taken from the system: most of this is not.
        surface=np.empty(columns * columns * layers, dtype=SURFACE),
    )


@njit(cache=True)
def bit(layer: int) -> np.uint64:
    """The bit of a layer."""
    return BIT << np.uint64(layer)


@njit(cache=True)
def wrapped(column: int, n: int) -> np.uint64:
    """Where a column of the world lives; unsigned, or each look-up asks whether it is negative."""
    return np.uint64(column & (n - 1))


@njit(cache=True)
def forget(grid: VoxelGrid, entry: int) -> None:
    """Take a point out of the list; the last one takes its place."""
    surface, last = grid.surface, grid.length[0] - 1
    gone, moved = surface[entry], surface[last]
    x, y, z = gone["column_x"], gone["column_y"], gone["layer"]
    grid.occupied[x, y] &= ~bit(z)
    grid.place[moved["column_x"], moved["column_y"], moved["layer"]] = entry
    grid.place[x, y, z] = -1
    surface[entry] = moved
    grid.length[0] = last


@njit(cache=True)
def move_window(grid: VoxelGrid, x: float, y: float, since: float) -> None:
    """Centre the window on (x, y) [m]; forget what leaves it or was last hit before `since` [s]."""
    n, size, surface = len(grid.seen), grid.size, grid.surface
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
        voxel = surface[entry]
        column_x = int(np.floor(voxel["x"] / size)) - new_x
        column_y = int(np.floor(voxel["y"] / size)) - new_y
        inside = 0 <= column_x < n and 0 <= column_y < n
        if not inside or voxel["time"] < since:
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
    found, room, surface = 0, len(out), grid.surface
    for entry in range(grid.length[0]):
        voxel = surface[entry]
        dx, dy = voxel["x"] - x, voxel["y"] - y
        squared = dx * dx + dy * dy
        if squared > far * far or found == room:
            continue
        colour = voxel["column_x"] + voxel["column_y"] + voxel["layer"]
        if squared <= near * near or colour & 1:
            out[found, 0], out[found, 1], out[found, 2] = voxel["x"], voxel["y"], voxel["z"]
            found += 1
    return found
