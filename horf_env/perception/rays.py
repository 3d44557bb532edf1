"""What a depth image tells a voxel grid: surfaces where rays end, free space before."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.perception.voxel_grid import VoxelGrid, bit, forget
from horf_env.types import FloatArray

# Lower points are floor [m]: the base would otherwise keep a distance from it.
_FLOOR_HEIGHT = 0.03
# The camera's depth error at 1 m [m], a D435's (see noise.py); it grows with the square.
_NOISE = 0.004
# Looks in a row that have to see through a point: one may be wrong at an edge.
_MOST_MISSES = 2
# Every fourth ray marks what it passes, and every fourth point is looked at whether it is still
# there; the four sets take turns.
_SETS = 4
_CLEARLY = 0.05  # m; a surface that is hit at a grazing angle varies by so much within a pixel
_DEVIATIONS = 4.0  # standard deviations of the noise that are not yet evidence


@njit(cache=True)
def take_in(
    grid: VoxelGrid,
    points: FloatArray,
    own: np.ndarray,
    depth: np.ndarray,
    T_world_camera: FloatArray,
    focal: tuple[float, float],
    depth_range: tuple[float, float],
    carving: bool,
    frame: int,
    time: float,
) -> None:
    """Learn from an image: free space, points that are gone, points that are there.

    Args:
        grid: The grid.
        points: Where the rays of the valid pixels ended, shape (N, 3), m.
        own: Which of them lie on the robot itself, shape (N,).
        depth: Image [m], shape (H, W); 0 = invalid.
        T_world_camera: Pose of the camera, shape (4, 4).
        focal: Focal lengths (fx, fy) [px].
        depth_range: Least and greatest depth that the camera measures [m].
        carving: Whether points that the camera sees through are forgotten.
        frame: How many images came before.
        time: Now [s].
    """
    origin = T_world_camera[:3, 3].copy()
    _mark_rays(grid, origin, points, frame % _SETS)
    if carving:
        _carve(grid, depth, T_world_camera, focal, depth_range, frame % _SETS)
    _insert(grid, points, own, origin, time)


@njit(cache=True)
def _mark_rays(grid: VoxelGrid, origin: FloatArray, ends: FloatArray, phase: int) -> None:
    """Mark as seen what lies on the rays of one set, up to half a voxel before their ends.

    Args:
        grid: The grid.
        origin: Common origin of the rays, shape (3,), m.
        ends: Where they end, shape (N, 3), m.
        phase: First ray.
    """
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size[0]
    first_x, first_y, seen = grid.first[0], grid.first[1], grid.seen
    for i in range(phase, len(ends), _SETS):
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
            seen[column_x, column_y] |= bit(int(z))
            x, y, z = x + dx, y + dy, z + dz


@njit(cache=True)
def _insert(
    grid: VoxelGrid, points: FloatArray, own: np.ndarray, origin: FloatArray, time: float
) -> None:
    """Put surface points into their voxels, but neither the robot's own nor those of the floor.

    A voxel keeps the point with the least expected square error: how far it is from the middle of
    the voxel (points in the middle are evenly spaced), and the camera's noise at its range.

    Args:
        grid: The grid.
        points: Shape (N, 3), m.
        own: Which of them lie on the robot itself, shape (N,).
        origin: Where the camera is, shape (3,), m.
        time: Now [s].
    """
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size[0]
    first, place, length, occupied = grid.first, grid.place, grid.length, grid.occupied
    voxel, errors, point = grid.voxel, grid.error, grid.point
    misses, times = grid.misses, grid.time
    for i in range(len(points)):
        if own[i] or points[i, 2] < _FLOOR_HEIGHT:
            continue
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        x, y, z = int(np.floor(px / size)), int(np.floor(py / size)), int(np.floor(pz / size))
        inside = 0 <= x - first[0] < n and 0 <= y - first[1] < n and 0 <= z < layers
        if not inside:
            continue
        ox, oy, oz = px / size - x - 0.5, py / size - y - 0.5, pz / size - z - 0.5
        squared = (px - origin[0]) ** 2 + (py - origin[1]) ** 2 + (pz - origin[2]) ** 2
        error = size * size * (ox * ox + oy * oy + oz * oz) + (_NOISE * squared) ** 2
        x, y = x & (n - 1), y & (n - 1)
        entry = place[x, y, z]
        if entry < 0:
            entry = length[0]
            length[0] += 1
            place[x, y, z] = entry
            occupied[x, y] |= bit(z)
            voxel[entry, 0], voxel[entry, 1], voxel[entry, 2] = x, y, z
            errors[entry] = np.inf
        if error <= errors[entry]:
            point[entry, 0], point[entry, 1], point[entry, 2] = px, py, pz
            errors[entry] = error
        misses[entry], times[entry] = 0, time


@njit(cache=True)
def _carve(
    grid: VoxelGrid,
    depth: np.ndarray,
    T_world_camera: FloatArray,
    focal: tuple[float, float],
    depth_range: tuple[float, float],
    phase: int,
) -> None:
    """Forget points that the camera now sees through.

    A frame misses a point if the pixel of its image and all beside it are valid and show something
    clearly farther away: an edge between two rays, or a hole in the image, is no evidence.

    Args:
        grid: The grid.
        depth: Image [m], shape (H, W); 0 = invalid.
        T_world_camera: Pose of the camera, shape (4, 4).
        focal: Focal lengths (fx, fy) [px].
        depth_range: Least and greatest depth that the camera measures [m].
        phase: First point to look at.
    """
    height, width = depth.shape
    R, t = T_world_camera[:3, :3], T_world_camera[:3, 3]
    point, length = grid.point, grid.length
    for entry in range(phase, length[0], _SETS):
        if entry >= length[0]:
            break  # some were forgotten on the way
        dx, dy = point[entry, 0] - t[0], point[entry, 1] - t[1]
        dz = point[entry, 2] - t[2]
        z = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz
        if not depth_range[0] < z < depth_range[1]:
            continue
        x = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz
        y = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz
        column = int(np.floor(focal[0] * x / z + 0.5 * width))
        row = int(np.floor(focal[1] * y / z + 0.5 * height))
        if not (0 <= column < width and 0 <= row < height):
            continue
        least = depth[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2].min()
        if least > z + _CLEARLY + _DEVIATIONS * _NOISE * z * z:
            grid.misses[entry] += 1
            if grid.misses[entry] >= _MOST_MISSES:
                grid.seen[grid.voxel[entry, 0], grid.voxel[entry, 1]] |= bit(grid.voxel[entry, 2])
                forget(grid, entry)
