"""What a memory of obstacles is: it is shown frames and asked for obstacle points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from horf_env.perception.image import Image
from horf_env.types import BoolArray, FloatArray


@dataclass(frozen=True)
class View:
    """One image and what it shows.

    Attributes:
        image: The image.
        T_world_camera: Pose of the camera at capture, shape (4, 4).
        points: Where the rays of the valid pixels ended, in the world, shape (N, 3), m.
        own: Which of the points lie on the robot's own arm, shape (N,).
    """

    image: Image
    T_world_camera: FloatArray
    points: FloatArray
    own: np.ndarray


class ObstacleMemory(Protocol):
    """Remembers what the camera has shown."""

    def reset(self, T_world_base: FloatArray, free: FloatArray) -> None:
        """Forget everything.

        Args:
            T_world_base: Where the robot starts, shape (4, 4).
            free: Points that fill space that is known to be free, in the world, shape (N, 3), m.
        """

    def add(self, view: View) -> None:
        """Take in a frame."""

    def occupy(self, T_world_base: FloatArray, arm: FloatArray) -> None:
        """Learn where the robot is, so that nothing else is there.

        Args:
            T_world_base: Pose of the base, shape (4, 4).
            arm: Points that fill the arm, in the world, shape (N, 3), m.
        """

    def points(self, T_world_base: FloatArray) -> FloatArray:
        """Obstacle points around the base, in the world, shape (N, 3), m."""

    def surfaces(self, place: FloatArray) -> FloatArray:
        """Points of surfaces that were seen around a place (2,), in the world, shape (N, 3), m."""

    def seen(self, points: FloatArray) -> BoolArray:
        """Which of the points (N, 3) [m] were looked at, shape (N,)."""

    def presume(self, behind: float) -> None:
        """Take unseen space up to so far behind surfaces [m] for occupied until the next reset."""

    def unseen(self, T_world_base: FloatArray) -> FloatArray:
        """Points of the ground near the base that were neither seen nor covered by it.

        Returns:
            In the world, shape (M, 2), m; none for a memory that does not tell.
        """


class MemorySettings(Protocol):
    """Settings that name a kind of memory and make one."""

    def make(self) -> ObstacleMemory:
        """An empty memory."""
