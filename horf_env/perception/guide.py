"""Hints that follow from what the robot knows: where the goal lies, and the way on its own map.

Not in the paper, whose policy sees depth images and the deviation. A policy has to work both out
from these otherwise: the axes of the goal by forward kinematics, the way by remembering.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from horf_env.perception.ways import CELL, GroundWays, SeenSpace, cell_of
from horf_env.robot.reachability import standing_cost
from horf_env.types import FloatArray

GUIDE_SIZE: Final = 13
"""Numbers of a guide."""

_REACH = 1.3  # m; beyond this no arm reaches a goal from a place


class Guide:
    """Hints on the way to one goal."""

    def __init__(self, goal: FloatArray, start: FloatArray, space: SeenSpace) -> None:
        """Find out from where the arm reaches the goal.

        Args:
            goal: Pose in the world, shape (4, 4).
            start: Position of the base, shape (2,), m.
            space: Tells what was seen.
        """
        self._goal = goal
        first = cell_of(goal[:2, 3] - _REACH)
        steps = np.arange(int(2 * _REACH / CELL) + 2)
        centres = (first[:, None] + steps + 0.5) * CELL
        places = np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1)
        stands = standing_cost(goal, places.reshape(-1, 2)).reshape(places.shape[:2])
        self.ways = GroundWays(start, goal[:2, 3], stands, first, space)

    def view(self, T_world_base: FloatArray) -> FloatArray:
        """What the guide says at a pose of the base.

        Args:
            T_world_base: Pose of the base, shape (4, 4).

        Returns:
            Shape (13,): position of the goal in the axes of the base [m], its approach (z) and its
            x axis; a point 0.8 m ahead on the way, x and y in the axes of the base [m]; length of
            way up to it [m], less where the way ends; and cost of the whole way [m].
        """
        R, t = T_world_base[:3, :3], T_world_base[:3, 3]
        self.ways.update(t[:2])
        ahead, length, cost = self.ways.ahead(t[:2], float(np.arctan2(R[1, 0], R[0, 0])))
        goal = R.T @ np.column_stack([self._goal[:3, 3] - t, self._goal[:3, 2], self._goal[:3, 0]])
        target = R[:2, :2].T @ (ahead - t[:2])
        return np.concatenate([goal.T.ravel(), target, [length, cost]])
