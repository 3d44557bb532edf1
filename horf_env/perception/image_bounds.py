"""Which pixels a body can cover: culls rays before they are cast."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray, IntArray

_AHEAD = 1e-6  # m; corners that are not this far ahead of the camera have no place in its image
_EDGE = 1e-3  # pixels; more than rounding moves a corner


@njit(cache=True)
def pixel_windows(
    corners: FloatArray,
    starts: IntArray,
    T_world_camera: FloatArray,
    T_world_bodies: FloatArray,
    focal: tuple[float, float],
    shape: tuple[int, int],
) -> IntArray:
    """Rows and columns of the image that hold all pixels whose rays can hit a body.

    Args:
        corners: Vertices of all bodies, each in its body's frame, shape (V, 3), m.
        starts: First vertex of each body, and the number of all, shape (B + 1,).
        T_world_camera: Pose of the camera, shape (4, 4).
        T_world_bodies: Poses of the bodies, shape (B, 4, 4).
        focal: Focal lengths (fx, fy) [px].
        shape: Rows and columns of the image.

    Returns:
        (first row, end of the rows, first column, end of the columns) of each body, shape (B, 4);
        an end is not above its first if the body is out of sight.
    """
    windows = np.zeros((len(T_world_bodies), 4), dtype=np.int64)
    R, t = T_world_camera[:3, :3], T_world_camera[:3, 3]
    place, slopes = np.empty(3), np.empty((2, 2))
    for b in range(len(windows)):
        T, ahead, behind = T_world_bodies[b], False, False
        slopes[:, 0], slopes[:, 1] = np.inf, -np.inf
        lowest, highest = np.full(2, np.inf), np.full(2, -np.inf)
        for v in range(starts[b], starts[b + 1]):
            _see(corners[v], T, R, t, place)
            visible = place[2] > _AHEAD
            ahead, behind = ahead or visible, behind or not visible
            for axis in range(2):
                lowest[axis] = min(lowest[axis], place[axis])
                highest[axis] = max(highest[axis], place[axis])
                if visible:
                    slope = place[axis] / place[2]
                    slopes[axis, 0] = min(slopes[axis, 0], slope)
                    slopes[axis, 1] = max(slopes[axis, 1], slope)
        if not ahead:
            continue
        for axis in range(2):
            # Beside the camera a body that reaches behind it leaves the image on that side.
            low = -np.inf if behind and lowest[axis] < 0.0 else slopes[axis, 0]
            high = np.inf if behind and highest[axis] > 0.0 else slopes[axis, 1]
            count, scale = shape[1 - axis], focal[axis]
            first = np.ceil(scale * low + 0.5 * count - 0.5 - _EDGE)
            last = np.floor(scale * high + 0.5 * count - 0.5 + _EDGE)
            windows[b, 2 - 2 * axis] = int(max(first, 0.0))
            windows[b, 3 - 2 * axis] = int(min(last, count - 1.0)) + 1
    return windows


@njit(cache=True)
def _see(
    corner: FloatArray, T: FloatArray, R: FloatArray, t: FloatArray, place: FloatArray
) -> None:
    """Write the place of a body's corner in camera axes."""
    place[:] = 0.0
    for i in range(3):
        offset = T[i, 3] - t[i]
        for j in range(3):
            offset += T[i, j] * corner[j]
        for k in range(3):
            place[k] += R[i, k] * offset
