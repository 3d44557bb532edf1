"""Scene 4: two rooms, a door between them, and a goal inside a bookshelf in the second room.

The paper shows the scene without its sizes. The bookshelf with two posts before it is that of the
published benchmark of RMMI, given a back and set against a wall.
"""

from __future__ import annotations

import numpy as np

from horf_env.scenes.families.clutter import random_clutter
from horf_env.scenes.families.footprint import Footprint
from horf_env.scenes.families.furniture import Furniture, box_between
from horf_env.scenes.families.layout import Layout, first_sound
from horf_env.scenes.families.shelf import GoalShelf, goal_shelf
from horf_env.scenes.families.walls import THICKNESS, Floor
from horf_env.scenes.scene import Box, Cylinder, Scene

FIRST = Floor(0.0, -3.0, 5.0, 3.0)
SECOND = Floor(5.0 + THICKNESS, -3.0, 10.0 + THICKNESS, 3.0)
"""The two rooms, m."""

DOOR_WIDTH = (0.95, 1.2)
"""Clear width of the door, m."""

_DOOR_HEIGHT, _WALL_HEIGHT = 2.0, 2.3
_DOOR_Y = (0.4, 1.8)
"""Distance of the door from the middle of the wall, m. Start and shelf are on the other side of
the middle, so that the straight line to the goal runs into the wall."""

_DOOR_ZONE = 0.9
"""Depth of the area on both sides of the door in which nothing stands, m."""

_START_X, _START_Y = (0.95, 1.6), (0.0, 2.0)
_SHELF_Y, _SHELF_FROM_CORNER = (0.0, 2.2), (0.9, 1.6)
_N_CLUTTER = (2, 4)
_CLUTTER_GAP = 0.1


class Doorway:
    """Two rooms with a door, goal in a bookshelf."""

    name = "doorway"
    base_path = 9.498  # m

    def generate(self, rng: np.random.Generator) -> Scene:
        """Draw a scene."""
        return first_sound(self._draft, rng)

    def _draft(self, rng: np.random.Generator) -> Scene:
        side = int(rng.choice((-1, 1)))
        door_y, door_width = side * rng.uniform(*_DOOR_Y), rng.uniform(*DOOR_WIDTH)
        layout = Layout(FIRST, SECOND)
        middle = (FIRST.x1 + SECOND.x0) / 2
        layout.reserve(Footprint(middle, door_y, _DOOR_ZONE, door_width / 2))
        target = _place_in_second_room(rng, _caged_shelf(rng), -side)
        layout.add(target.shelf)
        layout.reserve(_access(target))
        for floor in (FIRST, SECOND):
            for _ in range(rng.integers(*_N_CLUTTER, endpoint=True)):
                layout.scatter(rng, random_clutter(rng), floor, _CLUTTER_GAP)
        start_y = -side * rng.uniform(*_START_Y)
        base = (rng.uniform(*_START_X), start_y, rng.uniform(-np.pi, np.pi))
        return layout.scene(self.name, _walls(door_y, door_width), base, target.goal)


def _walls(door_y: float, door_width: float) -> tuple[Box, ...]:
    """The outer walls, and the wall between the rooms: left of, right of and above the door."""
    outer = Floor(FIRST.x0, FIRST.y0, SECOND.x1, FIRST.y1).walls(_WALL_HEIGHT)
    x0, x1, low, high = FIRST.x1, SECOND.x0, door_y - door_width / 2, door_y + door_width / 2
    return (
        *outer,
        box_between((x0, FIRST.y0, 0.0), (x1, low, _WALL_HEIGHT)),
        box_between((x0, high, 0.0), (x1, FIRST.y1, _WALL_HEIGHT)),
        box_between((x0, low, _DOOR_HEIGHT), (x1, high, _WALL_HEIGHT)),
    )


def _caged_shelf(rng: np.random.Generator) -> GoalShelf:
    """A bookshelf with the goal behind its front and two posts before it."""
    target = goal_shelf(
        rng, width=(1.0, 1.3), depth=(0.35, 0.5), reach=(0.06, 0.16), off_center=0.12
    )
    shelf, posts = target.shelf, []
    for side in (-1, 1):
        radius, half_height = rng.uniform(0.015, 0.035), rng.uniform(0.5, 0.7)
        x = shelf.footprint.half_x + radius + rng.uniform(0.01, 0.06)
        posts.append(Cylinder((x, side * rng.uniform(0.3, 0.42), half_height), radius, half_height))
    caged = Furniture(shelf.footprint, shelf.boxes, cylinders=tuple(posts))
    return GoalShelf(caged, target.goal)


def _place_in_second_room(rng: np.random.Generator, target: GoalShelf, side: int) -> GoalShelf:
    """Back to the far wall, or to a side wall near the far corner, at positive `side` y."""
    depth = target.shelf.footprint.half_x
    if rng.random() < 0.5:
        return target.placed(SECOND.x1 - depth, side * rng.uniform(*_SHELF_Y), np.pi)
    x = SECOND.x1 - rng.uniform(*_SHELF_FROM_CORNER)
    return target.placed(x, side * (SECOND.y1 - depth), -side * np.pi / 2)


def _access(target: GoalShelf) -> Footprint:
    """The area before the shelf, 1.2 m deep and as wide as the robot needs, kept free."""
    shelf = target.shelf.footprint
    x, y = shelf.axes()[0] * (shelf.half_x + 0.6) + (shelf.x, shelf.y)
    return Footprint(float(x), float(y), 0.6, 0.6, shelf.yaw)
