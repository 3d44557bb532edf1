"""What each scene has to satisfy before a planner looks at it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from horf_env.scenes.distance import obstacle_distance, outline_distance
from horf_env.scenes.scene import Scene
from horf_env.types import FloatArray

START_CLEARANCE = 0.9
"""Radius of the empty cylinder about the start, m: the arm reaches 0.65 m ahead of the base."""

GOAL_CLEARANCE = 0.08
"""Least distance from the goal point to any obstacle, m; the fingers are 2 cm wide."""

HAND_CLEARANCE = 0.05
"""Least distance from the sample points of the hand, m: half its thickness (3 cm) plus 2 cm."""

WRIST_CLEARANCE = 0.1
"""Least distance from the line on which the wrist comes in, m: its links have a radius of 6 cm."""

_HAND_SAMPLES = np.array(
    [
        [0.0, y, z]
        for z in (-0.19, -0.15, -0.11, -0.07, -0.04)
        for y in (-0.1, -0.05, 0.0, 0.05, 0.1)
    ]
)
"""Centre plane of the hand (0.2 m wide) and of the flange behind it, in the frame of the EE, m."""

_WRIST_SAMPLES = np.array([[0.0, 0.0, z] for z in (-0.25, -0.32, -0.4)])
"""Points on the line of approach behind the hand, in the frame of the EE, m."""


def start_is_clear(scene: Scene) -> bool:
    """Whether nothing, at any height, is within `START_CLEARANCE` of the start."""
    base = np.array([scene.start.base[:2]])
    return bool(outline_distance(scene, base)[0] >= START_CLEARANCE)


def goal_has_room(scene: Scene) -> bool:
    """Whether the goal point, the hand and the wrist keep clear of all obstacles and the floor."""
    rotation = Rotation.from_quat(scene.goal.quaternion_xyzw)
    position = np.array(scene.goal.position)
    required = (
        (np.zeros((1, 3)), GOAL_CLEARANCE),
        (_HAND_SAMPLES, HAND_CLEARANCE),
        (_WRIST_SAMPLES, WRIST_CLEARANCE),
    )
    return all(
        _clearance(scene, rotation.apply(samples) + position) >= clearance
        for samples, clearance in required
    )


def _clearance(scene: Scene, points: FloatArray) -> float:
    return float(min(obstacle_distance(scene, points).min(), points[:, 2].min()))
