"""Which ground the base may stand on: seen or covered before, or neither."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.perception.voxel_grid import COVERED, VoxelGrid, bit, wrapped
from horf_env.types import FloatArray


@njit(cache=True)
def mark_robot(
    grid: VoxelGrid,
    pose: tuple[float, float, float],
    box: tuple[float, float, float, float],
    radius: float,
    layers: np.uint64,
    arm: FloatArray,
) -> None:
    """Mark where the base stands as covered, and a disc about its centre and the arm as seen.

    Args:
        grid: The grid.
        pose: (x, y, theta) of the base, m and rad.
        box: (least x, greatest x, least y, greatest y) of its body in its own frame [m].
        radius: Of the disc [m].
        layers: Bits of the layers of the disc.
        arm: Points that fill the arm, shape (N, 3), m.
    """
    mark_points(grid, arm)
    n, size = len(grid.seen), grid.size
    x, y, theta = pose
    c, s = np.cos(theta), np.sin(theta)
    seen = grid.seen
    corner = np.sqrt(max(-box[0], box[1]) ** 2 + max(-box[2], box[3]) ** 2)
    reach = int(max(corner, radius) / size) + 1
    middle_x, middle_y = int(np.floor(x / size)), int(np.floor(y / size))
    for world_x in range(middle_x - reach, middle_x + reach + 1):
        for world_y in range(middle_y - reach, middle_y + reach + 1):
            dx, dy = (world_x + 0.5) * size - x, (world_y + 0.5) * size - y
            along, across = c * dx + s * dy, c * dy - s * dx
            in_body = box[0] <= along <= box[1] and box[2] <= across <= box[3]
            column = world_x & (n - 1), world_y & (n - 1)
            if in_body:
                seen[column] |= COVERED
            if dx * dx + dy * dy <= radius * radius:
                seen[column] |= layers


@njit(cache=True)
def unseen_ground(
    grid: VoxelGrid,
    x: float,
    y: float,
    layers: np.uint64,
    grace: int,
    near: np.ndarray,
    out: FloatArray,
) -> FloatArray:
    """Middles of the outermost columns that are unseen and not near seen ones.

    Args:
        grid: The grid.
        x: Middle of the area to look at [m].
        y: The same.
        layers: Bits of the layers that count: a column is seen if any of them was.
        grace: Unseen columns up to so many columns away from a seen one (king's moves) are passed
            over.
        near: Work space, uint8, shape (2, K + 2, K + 2); its shape says how large the area is.
        out: Work space, shape (M, 2), m.

    Returns:
        Shape (N, 2), m.
    """
    n, size, side, found = len(grid.seen), grid.size, near.shape[1] - 2, 0
    grid_seen, occupied = grid.seen, grid.occupied
    first_x = int(np.floor(x / size)) - side // 2
    first_y = int(np.floor(y / size)) - side // 2
    inner, outer = near[0], near[1]
    for i in range(side):
        row, marks = wrapped(first_x + i, n), inner[i + 1, 1:]
        for j in range(side):
            column = wrapped(first_y + j, n)
            marks[j] = (grid_seen[row, column] | occupied[row, column]) & layers != 0
    for _ in range(grace):
        _widen(inner, outer)
        inner, outer = outer, inner
    _widen(inner, outer)
    for i in range(side - 1, -1, -1):
        wide, narrow = outer[i + 1, 1:], inner[i + 1, 1:]
        if _count_different(wide, narrow, side) == 0:
            continue
        for j in range(side - 1, -1, -1):
            if wide[j] == narrow[j] or found == len(out):
                continue
            if grid_seen[wrapped(first_x + i, n), wrapped(first_y + j, n)] & COVERED:
                continue
            out[found, 0] = (first_x + i + 0.5) * size
            out[found, 1] = (first_y + j + 0.5) * size
            found += 1
    return out[:found].copy()


@njit(cache=True)
def _count_different(one: np.ndarray, other: np.ndarray, n: int) -> int:
    """In how many of the first n places two rows differ."""
    count = 0
    for j in range(n):
        count += one[j] != other[j]
    return count


@njit(cache=True)
def _widen(narrow: np.ndarray, wide: np.ndarray) -> None:
    """Mark what is marked and the eight columns around it; the border stays as it is."""
    side = len(narrow) - 2
    for i in range(1, side + 1):
        for j in range(1, side + 1):
            left = narrow[i - 1, j - 1] | narrow[i, j - 1] | narrow[i + 1, j - 1]
            middle = narrow[i - 1, j] | narrow[i, j] | narrow[i + 1, j]
            right = narrow[i - 1, j + 1] | narrow[i, j + 1] | narrow[i + 1, j + 1]
            wide[i, j] = left | middle | right


@njit(cache=True)
def mark_points(grid: VoxelGrid, points: FloatArray) -> None:
    """Mark the voxels of points (N, 3) [m] as seen."""
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size
    first_x, first_y, seen = grid.first[0], grid.first[1], grid.seen
    for i in range(len(points)):
        x, y = int(np.floor(points[i, 0] / size)), int(np.floor(points[i, 1] / size))
        z = int(np.floor(points[i, 2] / size))
        if 0 <= x - first_x < n and 0 <= y - first_y < n and 0 <= z < layers:
            seen[x & (n - 1), y & (n - 1)] |= bit(z)


@njit(cache=True)
def points_seen(grid: VoxelGrid, points: FloatArray) -> np.ndarray:
    """Which of the points (N, 3) [m] lie in voxels of the window that were seen, shape (N,)."""
    n, layers, size = len(grid.seen), grid.place.shape[2], grid.size
    seen = np.zeros(len(points), dtype=np.bool_)
    for i in range(len(points)):
        x, y = int(np.floor(points[i, 0] / size)), int(np.floor(points[i, 1] / size))
        z = int(np.floor(points[i, 2] / size))
        if 0 <= x - grid.first[0] < n and 0 <= y - grid.first[1] < n and 0 <= z < layers:
            column = x & (n - 1), y & (n - 1)
            seen[i] = (grid.seen[column] | grid.occupied[column]) & bit(z) != 0
    return seen
