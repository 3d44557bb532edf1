"""Scene 3: an open field with boxes on the floor and boxes that float, and a goal in free space.

The paper shows the scene without its sizes. Sizes and spacings are those of the published forest
of REMANI (8 x 8 m), stretched to the length of the paper's base path.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from horf_env.scenes.families.approach import LEVEL, TOOL_DOWN, Approach
from horf_env.scenes.families.footprint import Footprint
from horf_env.scenes.families.furniture import Furniture, box_between, crate
from horf_env.scenes.families.layout import Layout, first_sound
from horf_env.scenes.families.walls import Floor
from horf_env.scenes.scene import Scene

FLOOR = Floor(0.0, -4.0, 12.0, 4.0)
"""The field, m."""

N_FLOOR_BOXES = (18, 25)
N_FLOATING_BOXES = (15, 25)

_GROWN = Floor(2.4, -4.0, 12.0, 4.0)
"""Where boxes are: everywhere but around the start, m."""

_FLOOR_SPACING, _FLOATING_SPACING = 1.2, 1.0
"""Least distances between the centres of boxes of a kind, m."""

_APART = 0.02
"""Least distance between boxes seen from above, m: none stands in or under another."""

_FLOOR_EDGE, _FLOOR_HEIGHT = (0.1, 0.8), (0.4, 1.5)
_FLOATING_EDGE, _FLOATING_CENTER = (0.3, 0.6), (0.6, 1.1)
"""Edges, heights of floor boxes and heights of the centres of floating boxes, m."""

_WALL_HEIGHT = 1.5
_GOAL_X, _GOAL_Y, _GOAL_Z = (9.4, 10.8), (-2.8, 2.8), (0.45, 1.1)
_START_X, _START_Y = (0.95, 1.45), (-2.8, 2.8)


class Forest:
    """Field of standing and floating boxes."""

    name = "forest"
    base_path = 9.347  # m

    def generate(self, rng: np.random.Generator) -> Scene:
        """Draw a scene."""
        return first_sound(self._draft, rng)

    def _draft(self, rng: np.random.Generator) -> Scene:
        layout = Layout(_GROWN)
        _grow(rng, layout, _floor_box, _count(rng, N_FLOOR_BOXES), _FLOOR_SPACING)
        _grow(rng, layout, _floating_box, _count(rng, N_FLOATING_BOXES), _FLOATING_SPACING)
        position = (rng.uniform(*_GOAL_X), rng.uniform(*_GOAL_Y), rng.uniform(*_GOAL_Z))
        # Any direction that does not point back at the start.
        heading, pitch = rng.uniform(-np.pi / 2, np.pi / 2), rng.uniform(LEVEL, TOOL_DOWN)
        base = (rng.uniform(*_START_X), rng.uniform(*_START_Y), rng.uniform(-np.pi, np.pi))
        walls = FLOOR.walls(_WALL_HEIGHT)
        return layout.scene(self.name, walls, base, Approach(position, heading, pitch))


def _count(rng: np.random.Generator, bounds: tuple[int, int]) -> int:
    return int(rng.integers(*bounds, endpoint=True))


def _grow(
    rng: np.random.Generator,
    layout: Layout,
    make: Callable[[np.random.Generator], Furniture],
    count: int,
    spacing: float,
) -> None:
    """Add boxes of one kind at random places; the densities allowed here are far from jamming."""
    centers: list[tuple[float, float]] = []
    while len(centers) < count:
        x, y = rng.uniform(_GROWN.x0, _GROWN.x1), rng.uniform(_GROWN.y0, _GROWN.y1)
        if all(np.hypot(x - cx, y - cy) >= spacing for cx, cy in centers):
            box = make(rng).placed(x, y, rng.uniform(-np.pi, np.pi))
            if layout.add_if_fits(box, _APART):
                centers.append((x, y))


def _floor_box(rng: np.random.Generator) -> Furniture:
    return crate(rng.uniform(*_FLOOR_EDGE), rng.uniform(*_FLOOR_EDGE), rng.uniform(*_FLOOR_HEIGHT))


def _floating_box(rng: np.random.Generator) -> Furniture:
    a, b, c = rng.uniform(*_FLOATING_EDGE, size=3) / 2
    z = rng.uniform(*_FLOATING_CENTER)
    return Furniture(
        Footprint(0.0, 0.0, a, b), boxes=(box_between((-a, -b, z - c), (a, b, z + c)),)
    )
