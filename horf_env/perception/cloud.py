"""Point clouds from depth images, kept in the world frame over the last frames."""

from __future__ import annotations

from collections import deque

import numpy as np
from numba import njit

from horf_env.errors import SettingError
from horf_env.perception.camera import CameraModel, DepthImage
from horf_env.types import FloatArray

# Points below are floor [m]: the base would otherwise keep a distance from it. The step from floor
# to obstacle is larger than a pixel's depth error (not in the paper).
_FLOOR_HEIGHT = 0.03
# The paper keeps the point clouds of the last five frames.
_FRAMES = 5


def unproject(depth: DepthImage, model: CameraModel, T_world_camera: FloatArray) -> FloatArray:
    """Points that a depth image shows.

    Args:
        depth: Depth in m, shape (H, W); 0 = invalid.
        model: The camera.
        T_world_camera: Pose of the camera when the image was taken, shape (4, 4).

    Returns:
        One point in the world frame for each valid pixel, row by row, shape (N, 3), m.
    """
    return _unproject(depth, model.rays, T_world_camera)


@njit(cache=True)
def _unproject(depth: DepthImage, rays: FloatArray, T: FloatArray) -> FloatArray:
    points, found = np.empty((depth.size, 3)), 0
    # Numbers one by one: taken out of the pose for each pixel they cost more than the products.
    r00, r01, r02, t0 = T[0, 0], T[0, 1], T[0, 2], T[0, 3]
    r10, r11, r12, t1 = T[1, 0], T[1, 1], T[1, 2], T[1, 3]
    r20, r21, r22, t2 = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
    for i in range(depth.shape[0]):
        for j in range(depth.shape[1]):
            z = depth[i, j]
            if z <= 0.0:
                continue
            x, y = z * rays[i, j, 0], z * rays[i, j, 1]
            points[found, 0] = r00 * x + r01 * y + r02 * z + t0
            points[found, 1] = r10 * x + r11 * y + r12 * z + t1
            points[found, 2] = r20 * x + r21 * y + r22 * z + t2
            found += 1
    return points[:found]


def remove_floor(points: FloatArray, *, height: float = _FLOOR_HEIGHT) -> FloatArray:
    """Points that are not on the floor z = 0.

    Args:
        points: In the world frame, shape (N, 3), m.
        height: What is lower counts as floor [m].

    Returns:
        Shape (M, 3), M <= N.
    """
    return points[points[:, 2] >= height]


class CloudHistory:
    """The points of the last few frames in the world frame.

    Points do not move after capture: obstacles are taken to be at rest for that long. What must not
    be in the cloud (floor, the robot's own arm) is to be left out before a frame is added, with the
    configuration that the robot had when the frame was taken.
    """

    def __init__(self, frames: int = _FRAMES) -> None:
        """An empty history.

        Raises:
            SettingError: If `frames` is below 1.
        """
        if frames < 1:
            raise SettingError("frames", frames, "at least 1")
        self._frames: deque[FloatArray] = deque(maxlen=frames)

    def clear(self) -> None:
        """Forget everything."""
        self._frames.clear()

    def add(self, points: FloatArray) -> None:
        """Add the points of a new frame and drop the oldest frame.

        Args:
            points: In the world frame, already filtered, shape (N, 3), m.
        """
        self._frames.append(points)

    def points(self) -> FloatArray:
        """All points, oldest frame first, shape (N, 3), m; (0, 3) before the first frame."""
        return np.concatenate(self._frames) if self._frames else np.empty((0, 3))
