"""Goals: a point and the direction from which a hand comes to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from horf_env.scenes.families.furniture import planar_move
from horf_env.scenes.scene import Goal, Vector3

TOOL_DOWN = np.pi / 2
"""Pitch of a hand that points at the floor, rad."""

LEVEL = 0.0
"""Pitch of a hand that points horizontally, rad."""


@dataclass(frozen=True)
class Approach:
    """A goal as a person would say it.

    Attributes:
        position: Where the finger tips shall be, m.
        heading: Horizontal direction in which the hand points or, pointing down, in which the
            thumb side of the ready pose (the hand's x axis) points, rad.
        pitch: Angle by which the hand points below the horizontal, rad.
    """

    position: Vector3
    heading: float
    pitch: float

    def placed(self, x: float, y: float, yaw: float) -> Approach:
        """Turned by `yaw` (rad) about the origin, then moved by (x, y), m."""
        position = planar_move(self.position, x, y, yaw)
        return replace(self, position=position, heading=self.heading + yaw)

    def goal(self) -> Goal:
        """The pose: z axis along the approach, y axis (the opening of the fingers) horizontal.

        The arm in its ready pose has this orientation with heading 0 and pitch near `TOOL_DOWN`.
        """
        cos, sin = np.cos(self.pitch), np.sin(self.pitch)
        z_axis = np.array([cos, 0.0, -sin])
        x_axis = np.array([sin, 0.0, cos])
        R = np.column_stack([x_axis, np.cross(z_axis, x_axis), z_axis])
        rotation = Rotation.from_euler("z", self.heading) * Rotation.from_matrix(R)
        x, y, z, w = (float(c) for c in rotation.as_quat(canonical=True))
        return Goal(self.position, (x, y, z, w))
