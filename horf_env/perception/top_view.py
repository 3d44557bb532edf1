"""What the action layer knows of the surroundings, as an image seen from above.

Not in the paper, whose policy sees the last depth images only: those of a quarter of a second.
"""

from __future__ import annotations

from typing import Final

import numba
import numpy as np

from horf_env.robot.footprint import BASE_HEIGHT
from horf_env.types import FloatArray

CELLS: Final = 32
"""Cells along each side of the image."""

CELL: Final = 0.2
"""Edge of a cell [m]: the image covers 3.2 m to each side, all that the map holds."""

CHANNELS: Final = 3
"""Obstacles as high as the base, obstacles above it, edge of the ground that nobody has seen."""

_MARK = 255


def top_view(points: FloatArray, unseen: FloatArray, T_world_base: FloatArray) -> np.ndarray:
    """Draw obstacle points and unseen ground around the base, which looks along the first axis.

    Args:
        points: Obstacle points in the world, shape (N, 3), m.
        unseen: Edge of unseen ground in the world, shape (M, 2), m.
        T_world_base: Pose of the base, shape (4, 4).

    Returns:
        Shape (3, 32, 32), uint8: 0 or 255. Row i, column j is (i - 16, j - 16) * 0.2 m from the
        centre of the base in its axes.
    """
    image = np.zeros((CHANNELS, CELLS, CELLS), dtype=np.uint8)
    _draw(image, points, unseen, T_world_base, BASE_HEIGHT)
    return image


@numba.njit(cache=True)
def _draw(
    image: np.ndarray,
    points: FloatArray,
    unseen: FloatArray,
    T_world_base: FloatArray,
    base_height: float,
) -> None:
    x, y = T_world_base[0, 3], T_world_base[1, 3]
    c, s = T_world_base[0, 0] / CELL, T_world_base[1, 0] / CELL
    for k in range(len(points)):
        dx, dy = points[k, 0] - x, points[k, 1] - y
        i, j = _cell(dx, dy, c, s)
        if 0 <= i < CELLS and 0 <= j < CELLS:
            image[0 if points[k, 2] < base_height else 1, i, j] = _MARK
    for k in range(len(unseen)):
        dx, dy = unseen[k, 0] - x, unseen[k, 1] - y
        i, j = _cell(dx, dy, c, s)
        if 0 <= i < CELLS and 0 <= j < CELLS:
            image[2, i, j] = _MARK


@numba.njit(cache=True)
def _cell(dx: float, dy: float, c: float, s: float) -> tuple[int, int]:
    """Cell of an offset from the base [m]; c and s are its direction over the edge of a cell."""
    i, j = int(np.floor(c * dx + s * dy)), int(np.floor(c * dy - s * dx))
    return i + CELLS // 2, j + CELLS // 2
