"""Gradients with respect to the nine velocities against differences of fourth order."""

from __future__ import annotations

from typing import Any

import numpy as np
from sdf_oracles import brute_force

from horf_env.robot import LIMITS, ConvexPart, MobileManipulator, integrate
from horf_env.sdf import RobotSdf
from horf_env.types import FloatArray

# rad or m. Rounding leaves 1e-9. Where the nearest point passes from a face to an edge the second
# derivative jumps; longer steps meet such places more often, and err more there.
_STEP = 1e-6
# Weights of the values one and two steps ahead, less those behind.
_WEIGHTS = np.array([2.0 / 3.0, -1.0 / 12.0])
_CLOUD = 300  # points around the robot, the nearest of which counts
_BOX = np.array([[-2.0, -2.0, 0.05], [2.0, 2.0, 1.6]])  # m; where they lie
_TIE = 1e-3  # m; if two parts of a body are as near as this, the distance has a kink close by


def gradient_errors(
    robot: MobileManipulator,
    sdf: RobotSdf,
    bodies: tuple[tuple[ConvexPart, ...], ...],
    states: int,
    seed: int,
) -> dict[str, Any]:
    """Greatest error of the gradients at random configurations, away from ties.

    The nearest point of each body is held while the robot moves, so that the point does not switch.
    Left out are points inside a body, where faces tie, and points as near to a second part of it.
    """
    rng, limits = np.random.default_rng(seed), LIMITS["ld60"]
    errors, left_out = [], 0
    for _ in range(states):
        arm = rng.uniform(limits.arm_lower, limits.arm_upper)
        q = np.concatenate([rng.uniform(-1.0, 1.0, 3), arm])
        points = rng.uniform(_BOX[0], _BOX[1], (_CLOUD, 3))
        found = sdf.query(points, q)
        nearest = points[found.point_index]
        poses = robot.link_poses(q)
        numeric = _differences(robot, sdf, nearest, q)
        for k, parts in enumerate(bodies):
            local = (nearest[k] - poses[k, :3, 3]) @ poses[k, :3, :3]
            if _may_tie(parts, local):
                left_out += 1
            else:
                errors.append(np.abs(found.gradient[k] - numeric[k]).max())
    return {
        "compared": len(errors),
        "left_out": left_out,
        "max": float(np.max(errors)),
        "p99": float(np.percentile(errors, 99)),
    }


def _differences(
    robot: MobileManipulator, sdf: RobotSdf, points: FloatArray, q: FloatArray
) -> FloatArray:
    """Rates of the distance of point k to body k, shape (9, 9)."""
    rates = np.zeros((9, 9))
    for j, e in enumerate(np.eye(9)):
        for steps, weight in enumerate(_WEIGHTS, start=1):
            ahead = _distances(robot, sdf, points, integrate(q, e, steps * _STEP))
            behind = _distances(robot, sdf, points, integrate(q, -e, steps * _STEP))
            rates[:, j] += weight * (ahead - behind) / _STEP
    return rates


def _distances(
    robot: MobileManipulator, sdf: RobotSdf, points: FloatArray, q: FloatArray
) -> FloatArray:
    poses = robot.link_poses(q)
    local = np.einsum("kji,kj->ki", poses[:, :3, :3], points - poses[:, :3, 3])
    return np.array([sdf.link_distance(k, local[k : k + 1])[0] for k in range(len(points))])


def _may_tie(parts: tuple[ConvexPart, ...], point: FloatArray) -> bool:
    """Whether the point is inside the body, or two parts are nearly equally near."""
    distances = np.sort([brute_force([part], point[None])[0][0] for part in parts])
    return bool(distances[0] <= 0.0 or (np.diff(distances) < _TIE)[:1].any())
