"""The robot with its arm folded: easy to plan for.

Turning on the spot it stays inside two stacked cylinders about the axis of its base. Driving
straight it sweeps a strip that is narrower than the lower one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numba
import numpy as np

from horf_env.robot import MobileManipulator, collision_parts
from horf_env.scenes.scene import Scene
from horf_env.types import FloatArray

TUCKED_ARM = np.array([0.0, -1.5, 0.0, -2.4, 0.0, 0.7, np.pi / 4])
"""Upper arm back, forearm folded onto it, hand beside it [rad]: found by a search for a low and
slim pose, 1.19 m high and 0.23 m from the axis of the base."""

PATH_CLEARANCE = 0.02
"""Least distance from the cylinders to any obstacle on the way, m."""

_LINE_STEP = 0.02
"""Between checked points of a line, m: what lies between them is at most 0.2 mm nearer."""


@dataclass(frozen=True)
class Tucked:
    """Sizes of the folded robot about the axis of its base.

    Attributes:
        base_radius: Of the lower cylinder, m.
        base_half_width: Of the strip that the lower part sweeps, m.
        base_height: Up to where it reaches, m.
        arm_radius: Of the upper cylinder, m.
        arm_height: Up to where it reaches, m.
    """

    base_radius: float
    base_half_width: float
    base_height: float
    arm_radius: float
    arm_height: float


@dataclass(frozen=True)
class ForbiddenAreas:
    """Where the axis of the folded robot must not be (see `is_outside`).

    Attributes:
        turning: When it turns on the spot, shape (M, 7).
        driving: When it drives straight between two places where it can turn, shape (M, 7).
    """

    turning: FloatArray
    driving: FloatArray


def tucked_sizes(robot: MobileManipulator) -> Tucked:
    """The sizes, from the vertices of the collision geometry."""
    poses = robot.link_poses(np.concatenate([np.zeros(3), TUCKED_ARM]))
    parts = [
        part.vertices @ pose[:3, :3].T + pose[:3, 3]
        for body, pose in zip(collision_parts(), poses, strict=True)
        for part in body
    ]
    # The first part is the body of the base; the camera on its front is not higher.
    base_height = float(parts[0][:, 2].max())
    vertices = np.vstack(parts)
    radius = np.hypot(vertices[:, 0], vertices[:, 1])
    above = vertices[:, 2] > base_height
    lower = np.vstack([part for part in parts if part[:, 2].min() < base_height])
    return Tucked(
        base_radius=float(np.hypot(lower[:, 0], lower[:, 1]).max()),
        base_half_width=float(np.abs(lower[:, 1]).max()),
        base_height=base_height,
        arm_radius=float(radius[above].max()),
        arm_height=float(vertices[:, 2].max()),
    )


def forbidden_areas(scene: Scene, tucked: Tucked) -> ForbiddenAreas:
    """The areas that the obstacles of a scene forbid."""
    return ForbiddenAreas(
        turning=_areas(scene, tucked, tucked.base_radius),
        driving=_areas(scene, tucked, tucked.base_half_width),
    )


def can_turn(areas: ForbiddenAreas, point: FloatArray) -> bool:
    """Whether the folded robot can turn on the spot at (x, y), m."""
    return bool(is_outside(areas.turning, point[0], point[1]))


def can_drive(areas: ForbiddenAreas, start: FloatArray, end: FloatArray) -> bool:
    """Whether it can turn at both ends of a straight line and drive along it, m."""
    return (
        can_turn(areas, start)
        and can_turn(areas, end)
        and bool(_line_is_outside(areas.driving, start[0], start[1], end[0], end[1]))
    )


def _areas(scene: Scene, tucked: Tucked, base_width: float) -> FloatArray:
    bands = (
        (0.0, tucked.base_height, base_width),
        (tucked.base_height, tucked.arm_height, tucked.arm_radius),
    )
    rows = [
        (*outline, grown + width + PATH_CLEARANCE)
        for *outline, grown, bottom, top in _outlines(scene)
        for low, high, width in bands
        if top > low - PATH_CLEARANCE and bottom < high + PATH_CLEARANCE
    ]
    return np.array(rows).reshape(-1, 7)


def _outlines(scene: Scene) -> Iterator[tuple[float, ...]]:
    """Rectangle (6 numbers), its own radius, lower and upper end of each obstacle."""
    for box in scene.boxes:
        (x, y, z), (a, b, c) = box.center, box.half_extents
        yield x, y, np.cos(box.yaw), np.sin(box.yaw), a, b, 0.0, z - c, z + c
    for cylinder in scene.cylinders:
        (x, y, z), c = cylinder.center, cylinder.half_height
        yield x, y, 1.0, 0.0, 0.0, 0.0, cylinder.radius, z - c, z + c
    for sphere in scene.spheres:
        (x, y, z), r = sphere.center, sphere.radius
        yield x, y, 1.0, 0.0, 0.0, 0.0, r, z - r, z + r


@numba.njit  # type: ignore[untyped-decorator]  # numba has no types
def is_outside(areas: FloatArray, px: float, py: float) -> bool:
    """Whether a point is outside all areas. Compiled: a planner asks it 100,000 times a scene.

    Args:
        areas: Centre x and y, cosine and sine of the yaw and half extents of a rectangle, and the
            distance to keep from it, shape (M, 7); a disc is a rectangle without extent.
        px: x of the point, m.
        py: y of the point, m.
    """
    for x, y, cos, sin, half_x, half_y, width in areas:
        dx = abs(cos * (px - x) + sin * (py - y)) - half_x
        dy = abs(cos * (py - y) - sin * (px - x)) - half_y
        if max(dx, 0.0) ** 2 + max(dy, 0.0) ** 2 < width**2:
            return False
    return True


@numba.njit  # type: ignore[untyped-decorator]
def _line_is_outside(areas: FloatArray, ax: float, ay: float, bx: float, by: float) -> bool:
    count = int(np.ceil(np.hypot(bx - ax, by - ay) / _LINE_STEP)) + 1
    for k in range(count + 1):
        t = k / count
        if not is_outside(areas, ax + t * (bx - ax), ay + t * (by - ay)):
            return False
    return True
