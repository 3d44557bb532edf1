"""Walls around a rectangular floor."""

from __future__ import annotations

from dataclasses import dataclass

from horf_env.scenes.families.furniture import box_between
from horf_env.scenes.scene import Box

THICKNESS = 0.12
"""Thickness of a wall, m."""


@dataclass(frozen=True)
class Floor:
    """The rectangle inside the walls: x from x0 to x1 and y from y0 to y1, m."""

    x0: float
    y0: float
    x1: float
    y1: float

    def walls(self, height: float) -> tuple[Box, ...]:
        """Four walls that close the rectangle; those along x cover the corners."""
        t = THICKNESS
        return (
            box_between((self.x0 - t, self.y0 - t, 0.0), (self.x1 + t, self.y0, height)),
            box_between((self.x0 - t, self.y1, 0.0), (self.x1 + t, self.y1 + t, height)),
            box_between((self.x0 - t, self.y0, 0.0), (self.x0, self.y1, height)),
            box_between((self.x1, self.y0, 0.0), (self.x1 + t, self.y1, height)),
        )
