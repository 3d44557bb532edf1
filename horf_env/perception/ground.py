"""Which ground the base may stand on: seen or covered before, or neither."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.perception.voxel_grid import VoxelGrid
from horf_env.types import FloatArray


@njit(cache=True)
def mark_standing(
    grid: VoxelGrid,
    pose: tuple[float, float, float],
    box: tuple[float, float, float, float],
    radius: float,
    layers: np.uint64,
) -> None:
    """Mark as seen where the base stands, and a disc about its centre.

    Args:
        grid: The grid.
        pose: (x, y, theta) of the base, m and rad.
        box: (least x, greatest x, least y, greatest y) of its body in its own frame [m].
        radius: Of the disc [m].
        layers: Bits of the layers to mark.
    """
    n, size = len(grid.seen), grid.size[0]
    x, y, theta = pose
    c, s = np.cos(theta), np.sin(theta)
    corner = np.sqrt(max(-box[0], box[1]) ** 2 + max(-box[2], box[3]) ** 2)
    reach = int(max(corner, radius) / size) + 1
    middle_x, middle_y = int(np.floor(x / size)), int(np.floor(y / size))
    for world_x in range(middle_x - reach, middle_x + reach + 1):
        for world_y in range(middle_y - reach, middle_y + reach + 1):
            dx, dy = (world_x + 0.5) * size - x, (world_y + 0.5) * size - y
            along, across = c * dx + s * dy, c * dy - s * dx
            in_body = box[0] <= along <= box[1] and box[2] <= across <= box[3]
            if in_body or dx * dx + dy * dy <= radius * radius:
                grid.seen[world_x & (n - 1), world_y & (n - 1)] |= layers


@njit(cache=True)
def unseen_border(
    grid: VoxelGrid, x: float, y: float, radius: float, layers: np.uint64, out: FloatArray
) -> int:
    """Write the middles of unseen columns that lie beside a seen and empty one.

    Args:
        grid: The grid.
        x: Middle of the area to look at [m].
        y: The same.
        radius: Of that area [m].
        layers: Bits of the layers that count: a column is seen if any of them was.
        out: Written, shape (M, 2), m.

    Returns:
        How many were written.
    """
    n, size, found = len(grid.seen), grid.size[0], 0
    reach = int(radius / size)
    middle_x, middle_y = int(np.floor(x / size)), int(np.floor(y / size))
    for world_x in range(middle_x - reach, middle_x + reach + 1):
        for world_y in range(middle_y - reach, middle_y + reach + 1):
            dx, dy = (world_x + 0.5) * size - x, (world_y + 0.5) * size - y
            column = world_x & (n - 1), world_y & (n - 1)
            known = grid.seen[column] | grid.occupied[column]
            if known & layers or dx * dx + dy * dy > radius * radius or found == len(out):
                continue
            for step_x, step_y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                beside = (world_x + step_x) & (n - 1), (world_y + step_y) & (n - 1)
                if grid.seen[beside] & layers and not grid.occupied[beside] & layers:
                    out[found, 0], out[found, 1] = (world_x + 0.5) * size, (world_y + 0.5) * size
                    found += 1
                    break
    return found
