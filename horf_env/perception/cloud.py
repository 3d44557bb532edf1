"""Point clouds from depth images, kept in the world frame over the last frames."""

from __future__ import annotations

from collections import deque

import numpy as np

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
    valid = depth > 0.0
    points = model.rays[valid] * depth[valid][:, None]
    return points @ T_world_camera[:3, :3].T + T_world_camera[:3, 3]


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
            ValueError: If `frames` is below 1.
        """
        if frames < 1:
            raise ValueError(f"frames: expected at least 1, got {frames}")
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
