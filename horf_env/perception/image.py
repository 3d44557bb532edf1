"""A depth image with all that was true at the instant of its capture."""

from __future__ import annotations

from dataclasses import dataclass, replace

from horf_env.perception.camera import CameraModel, DepthImage
from horf_env.robot import RobotState


@dataclass(frozen=True)
class Image:
    """One depth image.

    Attributes:
        depth: In m, shape (H, W); 0 = invalid.
        model: The camera.
        state: State of the robot at capture.
        time: Time of capture since the start of the episode [s].
    """

    depth: DepthImage
    model: CameraModel
    state: RobotState
    time: float

    def with_depth(self, depth: DepthImage) -> Image:
        """The same with another depth, shape (H, W), m."""
        return replace(self, depth=depth)
