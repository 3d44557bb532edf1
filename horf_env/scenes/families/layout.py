"""A scene while it is being furnished."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from horf_env.errors import HorfEnvError
from horf_env.robot.limits import ARM_READY
from horf_env.scenes.families.approach import Approach
from horf_env.scenes.families.footprint import Footprint, keep_apart
from horf_env.scenes.families.furniture import Furniture
from horf_env.scenes.families.walls import Floor
from horf_env.scenes.laws import goal_has_room, start_is_clear
from horf_env.scenes.scene import Box, Scene, Start

_DECIMALS = 6
"""Coordinates are rounded to micrometres: short files, and equal on machines whose sine differs
in the last bit."""

_PLACEMENT_TRIES = 50
"""Random poses tried for a piece before it is left out."""

_DRAFTS = 1000
"""Drafts of a scene before its family is called wrong; the worst family needs a few dozen."""


class Layout:
    """Pieces on a floor that keep their distance from each other.

    Attributes:
        pieces: What has been placed.
    """

    def __init__(self, *floors: Floor) -> None:
        self.pieces: list[Furniture] = []
        self._floors = floors
        self._reserved: list[Footprint] = []

    def reserve(self, area: Footprint) -> None:
        """Keep a rectangle free of the pieces that are placed from now on."""
        self._reserved.append(area)

    def add(self, piece: Furniture) -> None:
        """Place a piece without asking."""
        self.pieces.append(piece)

    def add_if_fits(self, piece: Furniture, gap: float) -> bool:
        """Place a piece if it stays on one floor and `gap` (m) away from all others."""
        others = [other.footprint for other in self.pieces]
        fits = (
            any(_contains(floor, piece.footprint) for floor in self._floors)
            and all(keep_apart(piece.footprint, area, 0.0) for area in self._reserved)
            and all(keep_apart(piece.footprint, other, gap) for other in others)
        )
        if fits:
            self.add(piece)
        return fits

    def scatter(self, rng: np.random.Generator, piece: Furniture, floor: Floor, gap: float) -> bool:
        """Try random poses on a floor for a piece; returns whether one was free."""
        return any(
            self.add_if_fits(
                piece.placed(
                    rng.uniform(floor.x0, floor.x1),
                    rng.uniform(floor.y0, floor.y1),
                    rng.uniform(-np.pi, np.pi),
                ),
                gap,
            )
            for _ in range(_PLACEMENT_TRIES)
        )

    def scene(
        self, name: str, walls: Sequence[Box], base: tuple[float, float, float], goal: Approach
    ) -> Scene:
        """The furnished scene, with the arm in its ready pose and all numbers rounded."""
        q1, q2, q3, q4, q5, q6, q7 = map(float, ARM_READY)
        return Scene(
            name=name,
            boxes=_rounded((*walls, *(box for piece in self.pieces for box in piece.boxes))),
            cylinders=_rounded(tuple(c for piece in self.pieces for c in piece.cylinders)),
            spheres=_rounded(tuple(s for piece in self.pieces for s in piece.spheres)),
            start=_rounded(Start(base, (q1, q2, q3, q4, q5, q6, q7))),
            goal=_rounded(goal.goal()),
        )


def first_sound(draft: Callable[[np.random.Generator], Scene], rng: np.random.Generator) -> Scene:
    """Draft scenes until one keeps the laws about its start and its goal.

    Raises:
        HorfEnvError: If none of many drafts does: the family contradicts the laws.
    """
    for _ in range(_DRAFTS):
        scene = draft(rng)
        if start_is_clear(scene) and goal_has_room(scene):
            return scene
    raise HorfEnvError(f"no sound scene in {_DRAFTS} drafts by {draft.__qualname__}")


def _contains(floor: Floor, area: Footprint) -> bool:
    corners = area.corners()
    low, high = np.array([floor.x0, floor.y0]), np.array([floor.x1, floor.y1])
    tolerance = 1e-9  # m; pieces that stand against a wall touch it
    return bool(np.all((corners >= low - tolerance) & (corners <= high + tolerance)))


def _rounded(value: Any) -> Any:
    """The same (nested) value with all floats rounded."""
    if isinstance(value, float):
        return round(value, _DECIMALS)
    if isinstance(value, tuple):
        return tuple(map(_rounded, value))
    return type(value)(**{k: _rounded(v) for k, v in vars(value).items()})
