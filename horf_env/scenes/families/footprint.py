"""Rectangles on the floor: whether pieces of furniture keep their distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from horf_env.types import FloatArray


@dataclass(frozen=True)
class Footprint:
    """A rectangle on the floor.

    Attributes:
        x: Centre, m.
        y: Centre, m.
        half_x: Half of its length along its own x axis, m.
        half_y: Half of its length along its own y axis, m.
        yaw: Direction of its x axis, rad.
    """

    x: float
    y: float
    half_x: float
    half_y: float
    yaw: float = 0.0

    def axes(self) -> FloatArray:
        """Unit vectors of its sides in the world, one a row; shape (2, 2)."""
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[cos, sin], [-sin, cos]])

    def corners(self) -> FloatArray:
        """Corners in the world, shape (4, 2), m."""
        half = np.array([self.half_x, self.half_y])
        local = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half
        corners: FloatArray = local @ self.axes() + np.array([self.x, self.y])
        return corners

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance of points (N, 2) to the rectangle, 0 inside; shape (N,), m."""
        local = (points - np.array([self.x, self.y])) @ self.axes().T
        excess = np.abs(local) - np.array([self.half_x, self.half_y])
        distance: FloatArray = np.linalg.norm(np.maximum(excess, 0.0), axis=1)
        return distance


def keep_apart(a: Footprint, b: Footprint, gap: float) -> bool:
    """Whether two rectangles do not overlap and are at least `gap` (m) from each other."""
    centers = np.hypot(a.x - b.x, a.y - b.y)
    if centers - np.hypot(a.half_x, a.half_y) - np.hypot(b.half_x, b.half_y) > gap:
        return True  # even the circles around them are apart: nearly all pairs end here
    if not _separated_by_axis_of(a, b) and not _separated_by_axis_of(b, a):
        return False
    # Two convex polygons that are apart are nearest at a corner of one of them.
    return bool(min(a.distance(b.corners()).min(), b.distance(a.corners()).min()) >= gap)


def _separated_by_axis_of(a: Footprint, b: Footprint) -> bool:
    local = (b.corners() - np.array([a.x, a.y])) @ a.axes().T
    half = np.array([a.half_x, a.half_y])
    return bool(np.any((local.min(axis=0) > half) | (local.max(axis=0) < -half)))
