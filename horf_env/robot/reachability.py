"""Where the base may stand so that the arm reaches a goal.

The hand is held such that the arm cannot reach straight ahead to a level goal at the height of its
shoulder; it can from the side.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

from horf_env.robot import ARM_READY, MobileManipulator
from horf_env.robot.inverse_kinematics import arm_ik
from horf_env.robot.limits import ARM_LOWER, ARM_UPPER
from horf_env.types import FloatArray

_DISTANCES = np.array([0.45, 0.6, 0.75, 0.9, 1.05, 1.2])  # m
_DIRECTIONS = np.radians(np.arange(-180.0, 181.0, 30.0))
_LEVEL_AXES = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])  # of the gripper
_FROM_ABOVE, _DOWN = 0.8, 0.1  # m; where the gripper comes down from, and its steps
# Places to stand: least joint margin [rad], what is enough, and m of way for each rad less.
_LEAST_MARGIN, _ENOUGH_MARGIN, _STAND_COST = 0.1, 0.8, 4.0
_HEIGHT_STEP, _TILT_STEP = 0.05, 0.1  # m, rad; goals that are more alike share a map


def joint_margin(goal: FloatArray, places: FloatArray) -> FloatArray:
    """How far the arm's joints can stay from their limits if the base faces the goal from a place.

    Args:
        goal: Pose of the goal in the world, shape (4, 4).
        places: Centres of the base, shape (N, 2), m.

    Returns:
        Shape (N,), rad, least on the way from above; negative where no such way was found.
    """
    axis, offset = goal[:3, 2], goal[:2, 3] - places
    tilt = float(np.arctan2(-axis[2], np.hypot(axis[0], axis[1])))
    turned = np.arctan2(goal[0, 1], -goal[1, 1])  # the y axis of goals is level
    direction = np.arctan2(offset[:, 1], offset[:, 0]) - turned
    direction = np.arctan2(np.sin(direction), np.cos(direction))
    margins = _margins(round(goal[2, 3] / _HEIGHT_STEP), round(tilt / _TILT_STEP))
    lookup = RegularGridInterpolator(
        (_DISTANCES, _DIRECTIONS), margins, bounds_error=False, fill_value=-1.0
    )
    found: FloatArray = lookup(np.stack([np.linalg.norm(offset, axis=1), direction], axis=1))
    return found


def standing_cost(goal: FloatArray, places: FloatArray) -> FloatArray:
    """How good places of the base are to reach a goal from, as metres of way.

    Args:
        goal: Pose of the goal in the world, shape (4, 4).
        places: Centres of the base, shape (N, 2), m.

    Returns:
        Shape (N,), m; inf where the joints would be too near to their limits.
    """
    margin = joint_margin(goal, places)
    cost = _STAND_COST * np.maximum(_ENOUGH_MARGIN - margin, 0.0)
    return np.where(margin > _LEAST_MARGIN, cost, np.inf)


@lru_cache(maxsize=256)
def _margins(height_steps: int, tilt_steps: int) -> FloatArray:
    """Margins by distance and direction; see `_HEIGHT_STEP` and `_TILT_STEP`."""
    robot = MobileManipulator.load()
    goal = np.eye(4)
    tilt = Rotation.from_euler("y", tilt_steps * _TILT_STEP).as_matrix()
    goal[:3, :3] = tilt @ _LEVEL_AXES
    margins = np.empty((len(_DISTANCES), len(_DIRECTIONS)))
    for j, direction in enumerate(_DIRECTIONS):
        for i, distance in enumerate(_DISTANCES):
            goal[:3, 3] = [
                distance * np.cos(direction),
                distance * np.sin(direction),
                height_steps * _HEIGHT_STEP,
            ]
            margins[i, j] = _margin(robot, np.array([0.0, 0.0, direction]), goal)
    return margins


def _margin(robot: MobileManipulator, base: FloatArray, goal: FloatArray) -> float:
    """Least margin on the way from the ready pose to above the goal and down to it, or -1.

    A pose that no such way leads to is of no use: the arm is not moved from one branch of its
    inverse kinematics to another.
    """
    arm, least, height = ARM_READY, np.inf, float(goal[2, 3])
    highest = max(_FROM_ABOVE, height)
    steps = 1 + math.ceil((highest - height) / _DOWN)
    for way_height in np.linspace(highest, height, steps):
        place = goal.copy()
        place[2, 3] = way_height
        found = arm_ik(robot, base, place, arm)
        if found is None:
            return -1.0
        arm = found
        least = min(least, float((arm - ARM_LOWER).min()), float((ARM_UPPER - arm).min()))
    return least
