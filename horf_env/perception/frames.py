"""Depth images as the policy sees them: eight bits a pixel, the last few frames."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from horf_env.errors import SettingError
from horf_env.perception.camera import CameraModel, DepthImage

Frame = NDArray[np.uint8]

INVALID = 0
"""Grey value of a pixel without a measurement."""
_LEVELS = 254  # grey values 1 (near) to 255 (far), equally spaced
# The paper stacks the last five images.
_FRAMES = 5


def quantise_depth(depth: DepthImage, model: CameraModel) -> Frame:
    """Depth as grey values, linear from near (1) to far (255); 0 = invalid.

    One step is (far - near) / 254, so the error is at most half of it: 9.5 mm for 0.17 to 5 m.

    Args:
        depth: Depth in m, shape (H, W); 0 = invalid, the rest within the camera's range.
        model: The camera, for its range.

    Returns:
        Shape (H, W), uint8.
    """
    level = 1.0 + _LEVELS * (depth - model.near) / (model.far - model.near)
    return np.where(depth > 0.0, np.rint(level), INVALID).astype(np.uint8)


def dequantise_depth(frame: Frame, model: CameraModel) -> DepthImage:
    """Depth in m from grey values: the inverse of `quantise_depth` up to its rounding."""
    step = (model.far - model.near) / _LEVELS
    depth = model.near + step * (frame.astype(np.float32) - 1.0)
    return np.where(frame == INVALID, 0.0, depth).astype(np.float32)


def coarser(model: CameraModel, size: tuple[int, int]) -> tuple[np.ndarray, ...]:
    """Which pixels a coarser image of the same view keeps: those nearest to its own pixels' rays.

    Args:
        model: The camera.
        size: Width and height of the coarser image.

    Returns:
        Index of rows and columns, for `frame[index]`.

    Raises:
        SettingError: If the image has no pixels, or more than the camera's along an edge.
    """
    width, height = size
    if not (1 <= width <= model.width and 1 <= height <= model.height):
        raise SettingError("image", size, f"1x1 to {model.width}x{model.height} pixels")
    rows = (np.arange(height) + 0.5) * model.height / height
    columns = (np.arange(width) + 0.5) * model.width / width
    return np.ix_(rows.astype(int), columns.astype(int))


class FrameStack:
    """The last few frames, oldest first.

    Every stack that is handed out is a copy: a replay buffer may keep it.
    """

    def __init__(self, frames: int = _FRAMES) -> None:
        """An empty stack.

        Raises:
            ValueError: If `frames` is below 1.
        """
        if frames < 1:
            raise ValueError(f"frames: expected at least 1, got {frames}")
        self._frames: deque[Frame] = deque(maxlen=frames)
        self._count = frames

    def reset(self, frame: Frame) -> Frame:
        """Start an episode: every place is filled with the first frame.

        Args:
            frame: Shape (H, W).

        Returns:
            Shape (frames, H, W).
        """
        self._frames.extend([frame.copy()] * self._count)
        return np.array(self._frames)

    def push(self, frame: Frame) -> Frame:
        """Add a frame and drop the oldest one.

        Args:
            frame: Shape (H, W).

        Returns:
            Shape (frames, H, W).

        Raises:
            RuntimeError: If the stack has not been reset.
        """
        if not self._frames:
            raise RuntimeError("no first frame yet: call reset first")
        self._frames.append(frame.copy())
        return np.array(self._frames)
