"""Scene 2: a room with a table, chairs and boxes, and a goal above or under the table top.

The paper shows the scene without its sizes. The goal among four posts follows the table of the
published benchmark of RMMI: here the posts are bottles on the table, or the table's own legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from horf_env.scenes.families.approach import LEVEL, TOOL_DOWN, Approach
from horf_env.scenes.families.clutter import random_clutter
from horf_env.scenes.families.footprint import Footprint
from horf_env.scenes.families.furniture import Furniture, chair, table
from horf_env.scenes.families.layout import Layout, first_sound
from horf_env.scenes.families.walls import Floor
from horf_env.scenes.scene import Cylinder, Scene, Vector3

FLOOR = Floor(-4.0, -4.0, 4.0, 4.0)
"""The room, m."""

N_PIECES = (4, 8)
"""Chairs and boxes beside the table."""

_WALL_HEIGHT = 2.3
_TABLE_REACH, _START_REACH = 2.4, 3.05
"""Greatest distance of the table's and the start's centre from the room's, along each axis, m."""

_PATH = (5.9, 7.6)
"""Distance from the start to the goal, m; the base stops about 0.6 m before the goal."""

_GAP = 0.1
_CHAIR_PULLED_OUT = (0.05, 0.6)
"""Distance of a chair at the table from its edge, m."""


@dataclass(frozen=True)
class _GoalTable:
    """A table, a goal that is reached across its edge at y = -width / 2, and the area before it."""

    table: Furniture
    goal: Approach
    access: Furniture

    def placed(self, x: float, y: float, yaw: float) -> _GoalTable:
        pose = (x, y, yaw)
        return _GoalTable(
            self.table.placed(*pose), self.goal.placed(*pose), self.access.placed(*pose)
        )


class Room:
    """Furnished room, goal at a table."""

    name = "room"
    base_path = 6.301  # m

    def generate(self, rng: np.random.Generator) -> Scene:
        """Draw a scene."""
        return first_sound(self._draft, rng)

    def _draft(self, rng: np.random.Generator) -> Scene:
        target, base = _placed_target(rng, _goal_table(rng))
        layout = Layout(FLOOR)
        layout.add(target.table)
        layout.reserve(target.access.footprint)
        layout.reserve(Footprint(base[0], base[1], 0.9, 0.9))
        count = int(rng.integers(*N_PIECES, endpoint=True))
        _furnish(rng, layout, target.table.footprint, count)
        return layout.scene(self.name, FLOOR.walls(_WALL_HEIGHT), base, target.goal)


def _goal_table(rng: np.random.Generator) -> _GoalTable:
    length, width, height = rng.uniform(1.4, 2.0), rng.uniform(0.8, 1.1), rng.uniform(0.72, 0.8)
    desk = table(length, width, height, leg_radius=rng.uniform(0.03, 0.05))
    along = rng.uniform(-1.0, 1.0) * (length / 2 - 0.4)
    access = Furniture(Footprint(along, -width / 2 - 0.6, 0.6, 0.6))
    if rng.random() < 0.5:
        position = (along, -width / 2 + rng.uniform(0.06, 0.16), rng.uniform(0.32, 0.48))
        return _GoalTable(desk, Approach(position, np.pi / 2, LEVEL), access)
    position = (along, -width / 2 + rng.uniform(0.2, 0.35), height + rng.uniform(0.1, 0.3))
    heading = np.pi / 2 + rng.uniform(-0.4, 0.4)
    bottles = _bottles_around(rng, (*position[:2], height))
    desk = Furniture(desk.footprint, desk.boxes, (*desk.cylinders, *bottles))
    return _GoalTable(desk, Approach(position, heading, TOOL_DOWN), access)


def _bottles_around(rng: np.random.Generator, spot: Vector3) -> list[Cylinder]:
    """Four bottles that stand on the table top at the corners of a rectangle about `spot`."""
    bottles = []
    for side_x in (-1, 1):
        for side_y in (-1, 1):
            radius, half_height = rng.uniform(0.015, 0.04), rng.uniform(0.06, 0.18)
            x = spot[0] + side_x * rng.uniform(0.19, 0.26)
            y = spot[1] + side_y * rng.uniform(0.08, 0.15)
            bottles.append(Cylinder((x, y, spot[2] + half_height), radius, half_height))
    return bottles


def _placed_target(
    rng: np.random.Generator, target: _GoalTable
) -> tuple[_GoalTable, tuple[float, float, float]]:
    """The table somewhere in the room, and a start at the right distance from its goal."""
    while True:
        x, y = rng.uniform(-_TABLE_REACH, _TABLE_REACH, size=2)
        yaw = rng.integers(4) * np.pi / 2 + rng.uniform(-0.2, 0.2)
        placed = target.placed(x, y, yaw)
        start_x, start_y = rng.uniform(-_START_REACH, _START_REACH, size=2)
        goal_x, goal_y, _ = placed.goal.position
        if _PATH[0] <= np.hypot(goal_x - start_x, goal_y - start_y) <= _PATH[1]:
            return placed, (start_x, start_y, rng.uniform(-np.pi, np.pi))


def _furnish(rng: np.random.Generator, layout: Layout, desk: Footprint, count: int) -> None:
    """Some chairs at the table, the other pieces anywhere."""
    poses = _chair_poses(rng, desk)
    for k in rng.permutation(len(poses))[: rng.integers(1, count)]:
        local = poses[k]
        layout.add_if_fits(chair().placed(*local).placed(desk.x, desk.y, desk.yaw), 0.0)
    while len(layout.pieces) - 1 < count:
        layout.scatter(rng, random_clutter(rng), FLOOR, _GAP)


def _chair_poses(rng: np.random.Generator, desk: Footprint) -> list[tuple[float, float, float]]:
    """Poses (x, y, yaw) in the table's frame: two at each long side, one at each short side."""
    half = chair().footprint.half_x
    poses = []
    for side in (-1, 1):
        y = side * (desk.half_y + half + rng.uniform(*_CHAIR_PULLED_OUT))
        poses += [(along * desk.half_x, y, -side * np.pi / 2) for along in (-0.45, 0.45)]
        x = side * (desk.half_x + half + rng.uniform(*_CHAIR_PULLED_OUT))
        poses.append((x, 0.0, np.pi if side > 0 else 0.0))
    return poses
