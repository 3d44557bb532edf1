"""A bookshelf with a goal on one of its layers, shared by the families that have one."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from horf_env.scenes.families.approach import LEVEL, Approach
from horf_env.scenes.families.furniture import BOARD, Furniture, bookshelf

_PLINTH = 0.1
"""Height of the lowest board, m."""

_LAYER = (0.32, 0.42)
"""Distance between boards, m: books and boxes fit, and so does the hand."""

_LAYERS = 4
"""Layers of a shelf, as in the source of the corridor (Kindle 2020)."""

_GOAL_HEIGHT = (0.4, 1.2)
"""Height of the goal, m."""

_HAND_HALF_WIDTH = 0.18
"""Least distance of the goal from the sides of the shelf, m."""


@dataclass(frozen=True)
class GoalShelf:
    """A shelf about the origin, open towards +x, and the goal in it."""

    shelf: Furniture
    goal: Approach

    def placed(self, x: float, y: float, yaw: float) -> GoalShelf:
        """Turned by `yaw` (rad), then moved to (x, y), m."""
        return GoalShelf(self.shelf.placed(x, y, yaw), self.goal.placed(x, y, yaw))


def random_shelf(
    rng: np.random.Generator, *, width: tuple[float, float], depth: tuple[float, float]
) -> Furniture:
    """A shelf with random layers; ranges of its outer size in m."""
    return bookshelf(rng.uniform(*width), rng.uniform(*depth), _random_boards(rng))


def goal_shelf(
    rng: np.random.Generator,
    *,
    width: tuple[float, float],
    depth: tuple[float, float],
    reach: tuple[float, float],
    off_center: float = np.inf,
) -> GoalShelf:
    """A shelf with a goal on a random layer, which the hand enters levelly from the front.

    Args:
        rng: Source of randomness.
        width: Range of the outer width, m.
        depth: Range of the outer depth, m.
        reach: Range of the distance of the goal behind the front, m.
        off_center: Greatest sideways distance of the goal from the middle, m.
    """
    boards = _random_boards(rng)
    shelf = bookshelf(rng.uniform(*width), rng.uniform(*depth), boards)
    plan = shelf.footprint
    layers = [
        (low, high - BOARD)
        for low, high in pairwise(boards)
        if _GOAL_HEIGHT[0] <= (low + high - BOARD) / 2 <= _GOAL_HEIGHT[1]
    ]
    low, high = layers[rng.integers(len(layers))]
    aside = min(plan.half_y - _HAND_HALF_WIDTH, off_center)
    # Between a third and two thirds of the layer's height there is room for the hand.
    z = np.clip(rng.uniform(low + (high - low) / 3, high - (high - low) / 3), *_GOAL_HEIGHT)
    position = (plan.half_x - rng.uniform(*reach), rng.uniform(-aside, aside), float(z))
    return GoalShelf(shelf, Approach(position, heading=np.pi, pitch=LEVEL))


def _random_boards(rng: np.random.Generator) -> list[float]:
    """Heights of the upper sides of the boards, ascending, m."""
    heights = _PLINTH + np.cumsum([0.0, *rng.uniform(*_LAYER, size=_LAYERS)])
    return [float(z) for z in heights]
