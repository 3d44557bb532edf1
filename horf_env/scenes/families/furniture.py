"""Pieces of furniture, each built from boxes, cylinders and spheres that touch but do not overlap.

A piece is built about the origin of the floor with its front towards +x, then placed.
Sizes are those of ordinary furniture; none is in the paper.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from horf_env.scenes.families.footprint import Footprint
from horf_env.scenes.scene import Box, Cylinder, Sphere, Vector3
from horf_env.types import FloatArray

BOARD = 0.025
"""Thickness of shelf boards, sides and backs, m."""

TABLE_TOP = 0.04
"""Thickness of a table top, m."""

_CHAIR_WIDTH, _CHAIR_SEAT, _CHAIR_HEIGHT, _CHAIR_LEG = 0.44, 0.46, 0.92, 0.04
"""Edge of the (square) seat, height of its upper side, height of the back, edge of a leg; m."""


@dataclass(frozen=True)
class Furniture:
    """A rigid piece and the rectangle that it takes on the floor."""

    footprint: Footprint
    boxes: tuple[Box, ...] = ()
    cylinders: tuple[Cylinder, ...] = ()
    spheres: tuple[Sphere, ...] = ()

    def placed(self, x: float, y: float, yaw: float) -> Furniture:
        """The piece turned by `yaw` (rad) about the origin, then moved to (x, y), m."""

        def move(center: Vector3) -> Vector3:
            return planar_move(center, x, y, yaw)

        plan = self.footprint
        px, py, _ = move((plan.x, plan.y, 0.0))
        return Furniture(
            footprint=replace(plan, x=px, y=py, yaw=plan.yaw + yaw),
            boxes=tuple(replace(b, center=move(b.center), yaw=b.yaw + yaw) for b in self.boxes),
            cylinders=tuple(replace(c, center=move(c.center)) for c in self.cylinders),
            spheres=tuple(replace(s, center=move(s.center)) for s in self.spheres),
        )


def planar_move(point: Vector3, x: float, y: float, yaw: float) -> Vector3:
    """A point turned by `yaw` (rad) about the vertical axis, then moved by (x, y), m."""
    cos, sin = float(np.cos(yaw)), float(np.sin(yaw))
    return (x + cos * point[0] - sin * point[1], y + sin * point[0] + cos * point[1], point[2])


def box_between(low: Sequence[float], high: Sequence[float]) -> Box:
    """The box whose opposite corners are `low` and `high`, m."""
    lo, hi = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return Box(_vector((lo + hi) / 2), _vector((hi - lo) / 2), 0.0)


def _vector(values: FloatArray) -> Vector3:
    x, y, z = map(float, values)
    return x, y, z


def crate(length: float, width: float, height: float) -> Furniture:
    """A closed box on the floor (crate, cabinet, pallet)."""
    body = box_between((-length / 2, -width / 2, 0.0), (length / 2, width / 2, height))
    return Furniture(Footprint(0.0, 0.0, length / 2, width / 2), boxes=(body,))


def barrel(radius: float, height: float) -> Furniture:
    """A cylinder that stands on the floor."""
    body = Cylinder((0.0, 0.0, height / 2), radius, height / 2)
    return Furniture(Footprint(0.0, 0.0, radius, radius), cylinders=(body,))


def ball(radius: float) -> Furniture:
    """A sphere that lies on the floor."""
    footprint = Footprint(0.0, 0.0, radius, radius)
    return Furniture(footprint, spheres=(Sphere((0.0, 0.0, radius), radius),))


def bookshelf(width: float, depth: float, boards: Sequence[float]) -> Furniture:
    """An open shelf: two sides, a back, and boards whose upper sides are at the given heights.

    Args:
        width: Outer size along y, m.
        depth: Outer size along x, m; the shelf is open at x = depth / 2.
        boards: Heights of the upper sides, ascending, m; the last one is the top of the shelf.
    """
    back, front, inner = -depth / 2 + BOARD, depth / 2, width / 2 - BOARD
    height = boards[-1]
    sides = [
        box_between((-depth / 2, y, 0.0), (front, y + BOARD, height)) for y in (-width / 2, inner)
    ]
    panel = box_between((-depth / 2, -inner, 0.0), (back, inner, height))
    layers = [box_between((back, -inner, z - BOARD), (front, inner, z)) for z in boards]
    return Furniture(Footprint(0.0, 0.0, depth / 2, width / 2), boxes=(*sides, panel, *layers))


def table(length: float, width: float, height: float, leg_radius: float) -> Furniture:
    """A table top on four round legs; `length` is along x."""
    top = box_between(
        (-length / 2, -width / 2, height - TABLE_TOP), (length / 2, width / 2, height)
    )
    x, y, half = length / 2 - 2 * leg_radius, width / 2 - 2 * leg_radius, (height - TABLE_TOP) / 2
    legs = tuple(
        Cylinder((sx * x, sy * y, half), leg_radius, half) for sx in (-1, 1) for sy in (-1, 1)
    )
    return Furniture(Footprint(0.0, 0.0, length / 2, width / 2), boxes=(top,), cylinders=legs)


def chair() -> Furniture:
    """A chair with four legs, a seat and a back; whoever sits on it looks along +x."""
    half, under = _CHAIR_WIDTH / 2, _CHAIR_SEAT - _CHAIR_LEG
    seat = box_between((-half, -half, under), (half, half, _CHAIR_SEAT))
    back = box_between((-half, -half, _CHAIR_SEAT), (-half + _CHAIR_LEG, half, _CHAIR_HEIGHT))
    legs = tuple(
        box_between((x, y, 0.0), (x + _CHAIR_LEG, y + _CHAIR_LEG, under))
        for x in (-half, half - _CHAIR_LEG)
        for y in (-half, half - _CHAIR_LEG)
    )
    return Furniture(Footprint(0.0, 0.0, half, half), boxes=(seat, back, *legs))
