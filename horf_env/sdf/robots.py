"""What distance queries need to know of a robot: any robot, not this package's alone."""

from __future__ import annotations

from typing import Protocol

from horf_env.robot import Part
from horf_env.robot.parts import Elements
from horf_env.types import FloatArray


class Bodies(Protocol):
    """Where the bodies of a robot are, and how its velocities move them."""

    @property
    def link_poses(self) -> FloatArray:
        """T_world_body, shape (B, 4, 4)."""

    @property
    def body_jacobians(self) -> FloatArray:
        """Per body (linear; angular) velocity in world axes at its origin, shape (B, 6, n)."""


class Robot(Protocol):
    """Kinematics and geometry of a robot."""

    def state(self, configuration: FloatArray) -> Bodies:
        """Forward kinematics and Jacobians at a configuration."""

    def parts(self, elements: Elements) -> tuple[tuple[Part, ...], ...]:
        """Geometry of each body, in its frame."""
