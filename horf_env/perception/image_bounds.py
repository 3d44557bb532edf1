"""Which pixels a body can cover: culls rays before they are cast."""

from __future__ import annotations

from math import asin, atan2, ceil, floor, hypot, tan

import numpy as np

from horf_env.perception.camera import CameraModel
from horf_env.types import FloatArray


def bounding_sphere(vertices: FloatArray) -> tuple[FloatArray, float]:
    """A sphere around all vertices (not the smallest): centre (3,) and radius [m]."""
    centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    return centre, float(np.linalg.norm(vertices - centre, axis=1).max())


def pixel_window(
    model: CameraModel, centre: FloatArray, radius: float
) -> tuple[slice, slice] | None:
    """Rows and columns of the image that a sphere can touch.

    Args:
        model: The camera.
        centre: Centre of the sphere in camera axes, shape (3,), m.
        radius: Radius of the sphere [m].

    Returns:
        (rows, columns), which may hold a few pixels too many, never one too few; None if the sphere
        is out of sight.
    """
    x, y, z = centre.tolist()
    rows = _pixel_range(y, z, radius, 0.5 * model.vertical_fov, model.height)
    columns = _pixel_range(x, z, radius, 0.5 * model.horizontal_fov, model.width)
    return None if rows is None or columns is None else (rows, columns)


def _pixel_range(
    across: float, ahead: float, radius: float, half_fov: float, count: int
) -> slice | None:
    """Range along one image axis: between the two lines through the camera that touch a circle."""
    distance = hypot(across, ahead)
    if distance <= radius:
        return slice(0, count)
    middle, half_angle = atan2(across, ahead), asin(radius / distance)
    low, high = max(middle - half_angle, -half_fov), min(middle + half_angle, half_fov)
    if low >= high:
        return None
    focal = 0.5 * count / tan(half_fov)
    first = max(floor(focal * tan(low) + 0.5 * count), 0)
    last = min(ceil(focal * tan(high) + 0.5 * count), count)
    return slice(first, last)
