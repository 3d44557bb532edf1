"""The paper's memory: the point clouds of the last few frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from horf_env.perception.cloud import CloudHistory, remove_floor
from horf_env.perception.memory import View
from horf_env.perception.thinning import ring, thin
from horf_env.settings import check_counts
from horf_env.types import BoolArray, FloatArray

# Near the base points are so dense that a finger tip cannot pass the margin of 0.05 m between two
# of them; farther away, where only braking matters, they are wider apart. In m.
_NEAR_RANGE, _NEAR_VOXEL = 1.5, 0.02
_FAR_RANGE, _FAR_VOXEL = 3.0, 0.08


@dataclass(frozen=True)
class FrameSettings:
    """Settings of the memory of frames.

    Attributes:
        frames: How many frames are kept; five in the paper.
    """

    frames: int = 5

    def __post_init__(self) -> None:
        """Refuse a memory of nothing.

        Raises:
            SettingError: If the number of frames is not a whole number from 1 on.
        """
        check_counts(self, "frames")

    def make(self) -> FrameMemory:
        """An empty memory."""
        return FrameMemory(self)


class FrameMemory:
    """Points of the last few frames, where they were captured; knows nothing of the unseen."""

    def __init__(self, settings: FrameSettings) -> None:
        """An empty memory."""
        self._cloud = CloudHistory(settings.frames)

    def reset(self, T_world_base: FloatArray, free: FloatArray) -> None:
        """See `ObstacleMemory`."""
        self._cloud.clear()

    def add(self, view: View) -> None:
        """See `ObstacleMemory`."""
        self._cloud.add(remove_floor(view.points[~view.own]))

    def occupy(self, T_world_base: FloatArray, arm: FloatArray) -> None:
        """See `ObstacleMemory`: nothing to learn."""

    def points(self, T_world_base: FloatArray) -> FloatArray:
        """See `ObstacleMemory`; thinned, the newest first."""
        return self.surfaces(T_world_base[:2, 3])

    def surfaces(self, place: FloatArray) -> FloatArray:
        """See `ObstacleMemory`; thinned, the newest first."""
        points = self._cloud.points()[::-1]
        near = thin(ring(points, place, 0.0, _NEAR_RANGE), _NEAR_VOXEL)
        far = thin(ring(points, place, _NEAR_RANGE, _FAR_RANGE), _FAR_VOXEL)
        return np.concatenate([near, far])

    def seen(self, points: FloatArray) -> BoolArray:
        """See `ObstacleMemory`: it does not remember where it looked."""
        return np.zeros(len(points), dtype=np.bool_)

    def presume(self, behind: float) -> None:
        """See `ObstacleMemory`: it presumes nothing."""

    def unseen(self, T_world_base: FloatArray) -> FloatArray:
        """See `ObstacleMemory`."""
        return np.empty((0, 2))
