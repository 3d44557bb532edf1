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


class VoxelGrid(NamedTuple):
    """The arrays. C columns a side (a power of two), Z layers, room for N occupied voxels.

    Attributes:
        size: Edge of a voxel [m], shape (1,).
        first: World numbers of the window's first column, shape (2,).
        seen: Layers that a ray has passed or the base has covered, bits, shape (C, C).
        occupied: Layers with a surface point, bits, shape (C, C).
        place: Where an occupied voxel's point is in the lists below, -1 for none; (C, C, Z).
        length: Length of the lists, shape (1,).
        point: Surface point in the world [m], shape (N, 3).
        voxel: The voxel's place in the window, shape (N, 3).
        error: How far the point is expected to be from the ideal one [m], shape (N,).
        misses: Frames in a row that saw through the point, shape (N,).
        time: When the voxel was last hit [s], shape (N,).
    """

    size: np.ndarray
    first: np.ndarray
    seen: np.ndarray
    occupied: np.ndarray
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
def _bit(layer: int) -> np.uint64:
    return np.uint64(1) << np.uint64(layer)


@njit(cache=True)
def forget(grid: VoxelGrid, entry: int) -> None:
    """Take a point out of the lists; the last one takes its place."""
    x, y, z = grid.voxel[entry, 0], grid.voxel[entry, 1], grid.voxel[entry, 2]
    grid.place[x, y, z] = -1
    grid.occupied[x, y] &= ~_bit(z)
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
    for c in range(new_y, new_y + n):
        if not old_y <= c < old_y + n:
            grid.seen[:, c & (n - 1)] = 0
    grid.first[0], grid.first[1] = new_x, new_y
    for entry in range(grid.length[0] - 1, -1, -1):
        column_x = int(np.floor(grid.point[entry, 0] / size)) - new_x
        column_y = int(np.floor(grid.point[entry, 1] / size)) - new_y
        inside = 0 <= column_x < n and 0 <= column_y < n
        if not inside or grid.time[entry] < since:
            forget(grid, entry)


@njit(cache=True)
def mark_rays(grid: VoxelGrid, origin: FloatArray, ends: FloatArray, phase: int, step: int) -> None:
    """Mark as seen what lies on every `step`-th ray, up to half a voxel before its end.

    Args:
        grid: The grid.
        origin: Common origin of the rays, shape (3,), m.
        ends: Where they end, shape (N, 3), m.
        phase: First ray.
        step: How many rays farther the next one is.
    """
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size[0]
    first_x, first_y = grid.first[0], grid.first[1]
    for i in range(phase, len(ends), step):
        dx, dy, dz = ends[i, 0] - origin[0], ends[i, 1] - origin[1], ends[i, 2] - origin[2]
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        steps = int(length / size - 0.5)
        dx, dy, dz = dx / length, dy / length, dz / length
        # In voxels; half a voxel is added so that truncation (faster than floor) rounds down.
        x, y = origin[0] / size - first_x, origin[1] / size - first_y
        z = origin[2] / size
        for _ in range(steps + 1):
            if not (0.0 <= x < n and 0.0 <= y < n and 0.0 <= z < layers):
                break
            column_x, column_y = (int(x) + first_x) & (n - 1), (int(y) + first_y) & (n - 1)
            grid.seen[column_x, column_y] |= _bit(int(z))
            x, y, z = x + dx, y + dy, z + dz


@njit(cache=True)
def insert(
    grid: VoxelGrid,
    points: FloatArray,
    keep: np.ndarray,
    origin: FloatArray,
    noise: float,
    time: float,
) -> None:
    """Put surface points into their voxels.

    A voxel keeps the point with the least expected error: how far it is from the middle of the
    voxel (points in the middle are evenly spaced) plus the camera's noise at its range.

    Args:
        grid: The grid.
        points: Shape (N, 3), m.
        keep: Which of them to put in, shape (N,).
        origin: Where the camera is, shape (3,), m.
        noise: Standard deviation of the depth at 1 m [m]; it grows with the square of the range.
        time: Now [s].
    """
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size[0]
    for i in range(len(points)):
        if not keep[i]:
            continue
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        x, y, z = int(np.floor(px / size)), int(np.floor(py / size)), int(np.floor(pz / size))
        inside = 0 <= x - grid.first[0] < n and 0 <= y - grid.first[1] < n and 0 <= z < layers
        if not inside:
            continue
        ox, oy, oz = px / size - x - 0.5, py / size - y - 0.5, pz / size - z - 0.5
        squared = (px - origin[0]) ** 2 + (py - origin[1]) ** 2 + (pz - origin[2]) ** 2
        error = size * np.sqrt(ox * ox + oy * oy + oz * oz) + noise * squared
        x, y = x & (n - 1), y & (n - 1)
        entry = grid.place[x, y, z]
        if entry < 0:
            entry = grid.length[0]
            grid.length[0] += 1
            grid.place[x, y, z] = entry
            grid.occupied[x, y] |= _bit(z)
            grid.voxel[entry, 0], grid.voxel[entry, 1], grid.voxel[entry, 2] = x, y, z
            grid.error[entry] = np.inf
        if error <= grid.error[entry]:
            grid.point[entry, 0], grid.point[entry, 1], grid.point[entry, 2] = px, py, pz
            grid.error[entry] = error
        grid.misses[entry], grid.time[entry] = 0, time


@njit(cache=True)
def carve(
    grid: VoxelGrid,
    depth: np.ndarray,
    T_world_camera: FloatArray,
    focal: tuple[float, float],
    depth_range: tuple[float, float],
    noise: float,
    most_misses: int,
) -> None:
    """Forget points that the camera now sees through.

    A frame misses a point if all nine pixels around its image are valid and show something
    clearly farther away: an edge between two rays, or a hole in the image, is no evidence.

    Args:
        grid: The grid.
        depth: Image [m], shape (H, W); 0 = invalid.
        T_world_camera: Pose of the camera, shape (4, 4).
        focal: Focal lengths (fx, fy) [px].
        depth_range: Least and greatest depth that the camera measures [m].
        noise: Standard deviation of the depth at 1 m [m].
        most_misses: So many misses in a row are enough.
    """
    height, width = depth.shape
    R, t = T_world_camera[:3, :3], T_world_camera[:3, 3]
    for entry in range(grid.length[0] - 1, -1, -1):
        dx, dy = grid.point[entry, 0] - t[0], grid.point[entry, 1] - t[1]
        dz = grid.point[entry, 2] - t[2]
        z = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz
        if not depth_range[0] < z < depth_range[1]:
            continue
        x = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz
        y = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz
        column = int(np.floor(focal[0] * x / z + 0.5 * width))
        row = int(np.floor(focal[1] * y / z + 0.5 * height))
        if not (1 <= column < width - 1 and 1 <= row < height - 1):
            continue
        least = depth[row - 1 : row + 2, column - 1 : column + 2].min()
        if least > z + _CLEARLY + _DEVIATIONS * noise * z * z:
            grid.misses[entry] += 1
            if grid.misses[entry] >= most_misses:
                grid.seen[grid.voxel[entry, 0], grid.voxel[entry, 1]] |= _bit(grid.voxel[entry, 2])
                forget(grid, entry)


_CLEARLY = 0.05  # m; a surface that is hit at a grazing angle varies by so much within a pixel
_DEVIATIONS = 4.0  # standard deviations of the noise that are not yet evidence


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
    found, room = 0, len(out)
    for entry in range(grid.length[0]):
        dx, dy = grid.point[entry, 0] - x, grid.point[entry, 1] - y
        squared = dx * dx + dy * dy
        if squared > far * far or found == room:
            continue
        colour = grid.voxel[entry, 0] + grid.voxel[entry, 1] + grid.voxel[entry, 2]
        if squared <= near * near or colour & 1:
            for j in range(3):
                out[found, j] = grid.point[entry, j]
            found += 1
    return found


@njit(cache=True)
def shadowed_points(
    grid: VoxelGrid, x: float, y: float, radius: float, out: FloatArray, found: int
) -> int:
    """Append the middles of unseen voxels right above an occupied one, within a radius [m].

    Right above: with nothing but unseen voxels in between.

    Returns:
        How many points `out` holds now.
    """
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size[0]
    all_layers = ~np.uint64(0) >> np.uint64(64 - layers)
    reach = int(radius / size) + 1
    middle_x, middle_y = int(np.floor(x / size)), int(np.floor(y / size))
    for world_x in range(middle_x - reach, middle_x + reach + 1):
        for world_y in range(middle_y - reach, middle_y + reach + 1):
            column_x, column_y = world_x & (n - 1), world_y & (n - 1)
            occupied = grid.occupied[column_x, column_y]
            if occupied == 0:
                continue
            unseen = ~grid.seen[column_x, column_y]
            shadow = occupied
            for _ in range(layers):
                grown = shadow | ((shadow << np.uint64(1)) & unseen)
                if grown == shadow:
                    break
                shadow = grown
            shadow &= ~occupied & all_layers
            px, py = (world_x + 0.5) * size, (world_y + 0.5) * size
            if shadow == 0 or (px - x) ** 2 + (py - y) ** 2 > radius * radius:
                continue
            for z in range(layers):
                if shadow & _bit(z) and found < len(out):
                    out[found, 0], out[found, 1], out[found, 2] = px, py, (z + 0.5) * size
                    found += 1
    return found
