"""The motion fold, drive, turn, unfold as a dense sequence of configurations, and its check.

The density makes the check a proof: between two neighbouring configurations no point of the robot
moves farther than twice `MIN_CLEARANCE`, so a clearance of `MIN_CLEARANCE` at both is enough.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from feasibility.planning import densify
from horf_env.simulation import PyBulletWorld, WorldState
from horf_env.types import FloatArray

MIN_CLEARANCE = 0.01
"""Least clearance of each configuration of the motion, m."""

_DRIVE_STEP = 2 * MIN_CLEARANCE
"""Between neighbours while driving, m."""

_TURN_STEP = 2 * MIN_CLEARANCE / 0.45
"""Between neighbours while turning on the spot, rad; the folded robot reaches 0.43 m."""

_ARM_STEP = 2 * MIN_CLEARANCE / 1.8
"""Between neighbours while the arm moves, rad (norm over the joints). 1.8 m is an upper bound of
the norm of the distances from the seven axes to the farthest point that each of them moves."""


def whole_motion(
    start: FloatArray, fold: FloatArray, path: FloatArray, heading: float, unfold: FloatArray
) -> FloatArray:
    """All configurations from the start to the goal.

    Args:
        start: Pose (x, y, theta) of the base at the start, m and rad.
        fold: Joint path (N, 7) at the start, rad.
        path: Corners (M, 2) of the base's path, m.
        heading: Final heading of the base, rad.
        unfold: Joint path (K, 7) at the end, rad.

    Returns:
        Shape (L, 10).
    """
    tucked = fold[-1]
    bases = _turn_and_drive(start, path, heading)
    return np.vstack(
        [
            _configurations(start[None], densify(fold, _ARM_STEP)),
            _configurations(bases, tucked[None]),
            _configurations(bases[-1:], densify(unfold, _ARM_STEP)),
        ]
    )


def is_clear(world: PyBulletWorld, motion: FloatArray) -> bool:
    """Whether each configuration (L, 10) keeps `MIN_CLEARANCE` in the world's scene.

    No step takes a point of the robot farther than 2 `MIN_CLEARANCE`, so a large clearance speaks
    for the next configurations too, which are not asked then.
    """
    k = 0
    while k < len(motion):
        room = clearance(world, motion[k]) - MIN_CLEARANCE
        if room < 0.0:
            return False
        k += 1 + int(room / (2 * MIN_CLEARANCE))
    return True


def clearance(world: PyBulletWorld, configuration: FloatArray) -> float:
    """Clearance of one configuration (10,) in the world's scene, m."""
    world.set_state(WorldState(configuration, np.zeros(9)))
    return world.clearance.distance


def _turn_and_drive(start: FloatArray, path: FloatArray, heading: float) -> FloatArray:
    """Base poses (N, 3): at each corner turn the shorter way, then drive straight ahead."""
    pieces = [start[None]]
    theta = float(start[2])
    for a, b in pairwise(path):
        direction = float(np.arctan2(b[1] - a[1], b[0] - a[0]))
        turn = _turn(a, theta, direction)
        line = densify(np.array([a, b]), _DRIVE_STEP)
        theta = float(turn[-1, 2])
        pieces += [turn, np.column_stack([line, np.full(len(line), theta)])]
    return np.vstack([*pieces, _turn(path[-1], theta, heading)])


def _turn(position: FloatArray, start: float, end: float) -> FloatArray:
    angle = (end - start + np.pi) % (2 * np.pi) - np.pi
    headings = densify(np.array([[start], [start + angle]]), _TURN_STEP)
    return np.column_stack([np.broadcast_to(position, (len(headings), 2)), headings])


def _configurations(bases: FloatArray, arms: FloatArray) -> FloatArray:
    count = max(len(bases), len(arms))
    return np.hstack([np.broadcast_to(bases, (count, 3)), np.broadcast_to(arms, (count, 7))])
