"""What a depth image tells a voxel grid: surfaces where rays end, free space before."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.perception.voxel_grid import VoxelGrid, bit, forget, wrapped
from horf_env.types import FloatArray

# Lower points are floor [m]: the base would otherwise keep a distance from it.
_FLOOR_HEIGHT = 0.03
# The camera's depth error at 1 m [m], a D435's (see noise.py); it grows with the square.
_NOISE = 0.004
# More than rounding adds up to along a ray, in voxels.
_EDGE = 1e-6
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
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size
    first_x, first_y, seen = grid.first[0], grid.first[1], grid.seen
    ox, oy, oz = origin[0], origin[1], origin[2]
    # In voxels from the window's corner: there truncation, faster than floor, rounds down.
    start_x, start_y, start_z = ox / size - first_x, oy / size - first_y, oz / size
    for i in range(phase, len(ends), _SETS):
        dx, dy, dz = ends[i, 0] - ox, ends[i, 1] - oy, ends[i, 2] - oz
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        steps = int(length / size - 0.5) + 1
        dx, dy, dz = dx / length, dy / length, dz / length
        x, y, z = start_x, start_y, start_z
        inside = min(_steps_inside(x, dx, n), _steps_inside(y, dy, n))
        inside = min(inside, _steps_inside(z, dz, layers))
        for k in range(steps):
            if k >= inside and not (0.0 <= x < n and 0.0 <= y < n and 0.0 <= z < layers):
                break
            column_x, column_y = wrapped(int(x) + first_x, n), wrapped(int(y) + first_y, n)
            seen[column_x, column_y] |= bit(int(z))
            x, y, z = x + dx, y + dy, z + dz


@njit(cache=True)
def _steps_inside(place: float, step: float, end: int) -> int:
    """So many steps certainly do not leave [0, end), the first place included."""
    if not 0.0 <= place < end:
        return 0
    room = end - place if step > 0.0 else place
    return int(max(room - _EDGE, 0.0) / max(abs(step), _EDGE))


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
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size
    first_x, first_y = grid.first[0], grid.first[1]
    place, length, surface = grid.place, grid.length, grid.surface
    for i in range(len(points)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        if own[i] or pz < _FLOOR_HEIGHT:
            continue
        u, v, w = px / size, py / size, pz / size
        x, y, z = int(np.floor(u)), int(np.floor(v)), int(np.floor(w))
        inside = 0 <= x - first_x < n and 0 <= y - first_y < n and 0 <= z < layers
        if not inside:
            continue
        ox, oy, oz = u - x - 0.5, v - y - 0.5, w - z - 0.5
        squared = (px - origin[0]) ** 2 + (py - origin[1]) ** 2 + (pz - origin[2]) ** 2
        error = size * size * (ox * ox + oy * oy + oz * oz) + (_NOISE * squared) ** 2
        column_x, column_y, layer = wrapped(x, n), wrapped(y, n), np.uint64(z)
        entry = place[column_x, column_y, layer]
        if entry < 0:
            entry = length[0]
            length[0] += 1
            place[column_x, column_y, layer] = entry
            grid.occupied[column_x, column_y] |= bit(z)
            new = surface[entry]
            new["column_x"], new["column_y"], new["layer"] = column_x, column_y, layer
            new["error"] = np.inf
        voxel = surface[entry]
        if error <= voxel["error"]:
            voxel["x"], voxel["y"], voxel["z"] = px, py, pz
            voxel["error"] = error
        voxel["misses"], voxel["time"] = 0, time


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
    r00, r10, r20 = R[0, 0], R[1, 0], R[2, 0]
    r01, r11, r21 = R[0, 1], R[1, 1], R[2, 1]
    r02, r12, r22 = R[0, 2], R[1, 2], R[2, 2]
    t0, t1, t2 = t[0], t[1], t[2]
    surface, length = grid.surface, grid.length
    for entry in range(phase, length[0], _SETS):
        if entry >= length[0]:
            break  # some were forgotten on the way
        voxel = surface[entry]
        dx, dy, dz = voxel["x"] - t0, voxel["y"] - t1, voxel["z"] - t2
        z = r02 * dx + r12 * dy + r22 * dz
        if not depth_range[0] < z < depth_range[1]:
            continue
        x = r00 * dx + r10 * dy + r20 * dz
        y = r01 * dx + r11 * dy + r21 * dz
        column = int(np.floor(focal[0] * x / z + 0.5 * width))
        row = int(np.floor(focal[1] * y / z + 0.5 * height))
        if not (0 <= column < width and 0 <= row < height):
            continue
        if _least_around(depth, row, column) > z + _CLEARLY + _DEVIATIONS * _NOISE * z * z:
            voxel["misses"] += 1
            if voxel["misses"] >= _MOST_MISSES:
                grid.seen[voxel["column_x"], voxel["column_y"]] |= bit(voxel["layer"])
                forget(grid, entry)


@njit(cache=True)
def _least_around(depth: np.ndarray, row: int, column: int) -> float:
    """Least depth of a pixel and all beside it [m]."""
    least = depth[row, column]
    for i in range(max(row - 1, 0), min(row + 2, depth.shape[0])):
        for j in range(max(column - 1, 0), min(column + 2, depth.shape[1])):
            least = min(least, depth[i, j])
    return least
