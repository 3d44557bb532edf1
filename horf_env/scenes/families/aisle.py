"""Scene 1: a corridor with clutter on both sides and a goal on a shelf at its far end.

The paper shows the scene without its sizes. The corridor follows the published source of its
baseline RLMM (Kindle 2020): about 16 x 3 m, furniture along the walls, gaps of 1.25 m and more.
"""

from __future__ import annotations

import numpy as np

from horf_env.scenes.families.footprint import keep_apart
from horf_env.scenes.families.furniture import Furniture, barrel, crate
from horf_env.scenes.families.layout import Layout, first_sound
from horf_env.scenes.families.shelf import goal_shelf, random_shelf
from horf_env.scenes.families.walls import Floor
from horf_env.scenes.scene import Scene

FLOOR = Floor(0.0, -1.5, 16.0, 1.5)
"""The corridor, m."""

MIN_GAP = 1.25
"""Least distance between furniture of the two sides, m."""

_WALL_HEIGHT = 2.0
_START_X, _START_Y = (0.95, 1.7), 0.55
_SHELF_X = (13.3, 14.8)
_CLUTTER_FROM = 2.7
_SIDE_GAP = (0.2, 1.6)
"""Free length between two pieces on one side, m."""


class Aisle:
    """Corridor with a goal on a shelf."""

    name = "aisle"
    base_path = 12.826  # m

    def generate(self, rng: np.random.Generator) -> Scene:
        """Draw a scene."""
        return first_sound(self._draft, rng)

    def _draft(self, rng: np.random.Generator) -> Scene:
        layout = Layout(FLOOR)
        side = int(rng.choice((-1, 1)))
        target = goal_shelf(rng, width=(0.9, 1.4), depth=(0.35, 0.45), reach=(0.06, 0.14))
        target = target.placed(*_against_wall(target.shelf, rng.uniform(*_SHELF_X), side))
        layout.add(target.shelf)
        for clutter_side in rng.permutation((-1, 1)):
            _furnish_side(rng, layout, int(clutter_side))
        base = (
            rng.uniform(*_START_X),
            rng.uniform(-_START_Y, _START_Y),
            rng.uniform(-np.pi, np.pi),
        )
        return layout.scene(self.name, FLOOR.walls(_WALL_HEIGHT), base, target.goal)


def _against_wall(piece: Furniture, x: float, side: int) -> tuple[float, float, float]:
    """Pose (x, y, yaw) of a piece with its back to the wall at y = 1.5 side."""
    return x, side * (FLOOR.y1 - piece.footprint.half_x), -side * np.pi / 2


def _furnish_side(rng: np.random.Generator, layout: Layout, side: int) -> None:
    """Walk along a wall and put pieces against it wherever the gaps allow."""
    x = _CLUTTER_FROM + rng.uniform(*_SIDE_GAP)
    while True:
        piece = _random_piece(rng)
        half_length = piece.footprint.half_y
        x += half_length
        if x + half_length > FLOOR.x1:
            return
        piece = piece.placed(*_against_wall(piece, x, side))
        if _keeps_gaps(layout, piece):
            layout.add(piece)
        x += half_length + rng.uniform(*_SIDE_GAP)


def _keeps_gaps(layout: Layout, piece: Furniture) -> bool:
    """Whether a piece leaves the corridor open and its neighbours on the same side alone."""
    return all(
        keep_apart(
            piece.footprint,
            other.footprint,
            MIN_GAP if other.footprint.y * piece.footprint.y < 0 else _SIDE_GAP[0],
        )
        for other in layout.pieces
    )


def _random_piece(rng: np.random.Generator) -> Furniture:
    """A piece whose back is at -x: a crate (sometimes a deep one), a barrel or a shelf."""
    kind = rng.choice(["crate", "deep crate", "barrel", "shelf"], p=[0.35, 0.2, 0.2, 0.25])
    if kind == "barrel":
        return barrel(rng.uniform(0.15, 0.3), rng.uniform(0.6, 1.1))
    if kind == "shelf":
        return random_shelf(rng, width=(0.7, 1.6), depth=(0.3, 0.45))
    depth = rng.uniform(0.2, 0.7) if kind == "crate" else rng.uniform(1.0, 1.7)
    return crate(depth, rng.uniform(0.3, 1.75), rng.uniform(0.4, 1.5))
