"""Pinhole model of the depth camera and its place on the base."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from horf_env.errors import SettingError
from horf_env.types import FloatArray

DepthImage = NDArray[np.float32]
"""Depth along the optical axis in m, shape (H, W); 0 where there is no measurement."""

# RealSense D435, data sheet: depth field of view 87 x 58 degrees, least depth 0.17 m (at 848x480).
_HORIZONTAL_FOV = np.deg2rad(87.0)
_VERTICAL_FOV = np.deg2rad(58.0)
_NEAR = 0.17
# Farthest depth [m] that is used: beyond it the D435's error is over 0.09 m (not in the paper).
_FAR = 5.0
# On the front of the LD-60, centre of the camera housing [m]; not in the paper.
_POSITION = (0.365, 0.0, 0.33)
# Pitched up: a level camera at this height never sees what the arm can hit (not in the paper).
_PITCH_UP = np.deg2rad(15.0)
# Pixels: enough to see a table leg at 2 m, few enough for an observation of five frames.
_WIDTH, _HEIGHT = 64, 48


@dataclass(frozen=True)
class CameraModel:
    """Ideal pinhole camera whose pixels need not be square.

    Camera axes: x to the right of the image, y down, z forward along the optical axis. Pixel
    (row 0, column 0) is the upper left one; a pixel stands for the ray through its centre.

    Attributes:
        width: Columns of the image.
        height: Rows of the image.
        horizontal_fov: Angle between the left and right edge of the image [rad].
        vertical_fov: Angle between the upper and lower edge of the image [rad].
        near: Least depth that is measured [m].
        far: Greatest depth that is measured [m].
        position: Optical centre in the frame of the base [m].
        pitch_up: Angle of the optical axis above the base's x axis [rad].
    """

    width: int = _WIDTH
    height: int = _HEIGHT
    horizontal_fov: float = _HORIZONTAL_FOV
    vertical_fov: float = _VERTICAL_FOV
    near: float = _NEAR
    far: float = _FAR
    position: tuple[float, float, float] = _POSITION
    pitch_up: float = _PITCH_UP

    def __post_init__(self) -> None:
        """Refuse what is no camera.

        Raises:
            SettingError: If a size is below 1, a field of view outside (0, pi), the range empty or
                the pose not finite.
        """
        if min(self.width, self.height) < 1:
            raise SettingError("camera", f"{self.width}x{self.height}", "at least 1x1 pixels")
        if not (0.0 < self.horizontal_fov < np.pi and 0.0 < self.vertical_fov < np.pi):
            fields = (self.horizontal_fov, self.vertical_fov)
            raise SettingError("camera", fields, "fields of view between 0 and pi rad")
        if not 0.0 < self.near < self.far:
            raise SettingError("camera", (self.near, self.far), "0 < near < far")
        pose = (*self.position, self.pitch_up)
        if len(pose) != 4 or not np.isfinite(pose).all():
            raise SettingError("camera", pose, "a position of three numbers and a pitch")

    @cached_property
    def focal_lengths(self) -> tuple[float, float]:
        """(fx, fy) in pixels."""
        fx = 0.5 * self.width / np.tan(0.5 * self.horizontal_fov)
        fy = 0.5 * self.height / np.tan(0.5 * self.vertical_fov)
        return float(fx), float(fy)

    @cached_property
    def rays(self) -> FloatArray:
        """Direction of each pixel in camera axes with z = 1, so that point = depth * ray.

        Returns:
            Shape (H, W, 3), read-only.
        """
        fx, fy = self.focal_lengths
        x = (np.arange(self.width) + 0.5 - 0.5 * self.width) / fx
        y = (np.arange(self.height) + 0.5 - 0.5 * self.height) / fy
        rays = np.ones((self.height, self.width, 3))
        rays[..., 0] = x
        rays[..., 1] = y[:, None]
        rays.setflags(write=False)
        return rays

    @cached_property
    def T_base_camera(self) -> FloatArray:  # noqa: N802, poses are called T_a_b throughout
        """Pose of the camera in the frame of the base, shape (4, 4), read-only."""
        s, c = np.sin(self.pitch_up), np.cos(self.pitch_up)
        T = np.eye(4)
        # Columns: image right = -y of the base, image down, optical axis.
        T[:3, :3] = [[0.0, s, c], [-1.0, 0.0, 0.0], [0.0, -c, s]]
        T[:3, 3] = self.position
        T.setflags(write=False)
        return T

    def within_range(self, depth: DepthImage) -> DepthImage:
        """Set to 0, in place, what the camera cannot measure; returns `depth`."""
        depth[(depth < self.near) | (depth > self.far)] = 0.0
        return depth
