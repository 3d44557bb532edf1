"""What is kept of a step: enough for a recording, a hundredth of the record's memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from horf_env.perception.camera import DepthImage
from horf_env.records import StepRecord
from horf_env.task import RewardTerms
from horf_env.types import FloatArray

DEPTH_UNITS_PER_METRE = 1000.0
"""Depth is stored in whole mm as uint16: half the size of float32, finer than any camera."""

_MOST_POINTS = 1000
"""Points of a cloud that are stored: 12 kB, so that a 20 s episode stays below 5 MB."""


@dataclass(frozen=True)
class ActionSample:
    """What an action led to.

    Attributes:
        body_distances: Distance of each body to its nearest perceived point [m], nan where no
            point is near; shape (9,), or None if the layer looks at no points.
        twist_wanted: EE twist that was asked for, shape (6,), m/s and rad/s.
        twist_achieved: EE twist of the motion, shape (6,), m/s and rad/s.
        slack: Slack shared by the avoidance rows of the QP [m/s]; None without a QP.
        solve_time: Time of the QP [s]; None without a QP.
        reward: Terms of the reward.
    """

    body_distances: FloatArray | None
    twist_wanted: FloatArray
    twist_achieved: FloatArray
    slack: float | None
    solve_time: float | None
    reward: RewardTerms


@dataclass(frozen=True)
class Sample:
    """One step.

    Attributes:
        time: Simulated time [s].
        link_poses: T_world_body, shape (9, 4, 4).
        T_world_ee: Pose of the end effector, shape (4, 4).
        min_distance: True clearance during the step [m].
        action: None at the start of an episode.
    """

    time: float
    link_poses: FloatArray
    T_world_ee: FloatArray
    min_distance: float
    action: ActionSample | None


@dataclass(frozen=True)
class View:
    """What the robot saw at a step.

    Attributes:
        step: Number of the step.
        time: Simulated time [s].
        depth: In mm, shape (H, W).
        points: Obstacle points in the world, shape (N, 3), m.
    """

    step: int
    time: float
    depth: NDArray[np.uint16]
    points: NDArray[np.float32]


def sample(record: StepRecord) -> Sample:
    """Keep the state and the numbers of a record."""
    return Sample(
        time=record.time,
        link_poses=record.state.link_poses,
        T_world_ee=record.state.T_world_ee,
        min_distance=record.min_distance,
        action=_action_sample(record),
    )


def view(record: StepRecord, step: int) -> View:
    """Keep the depth image, and the cloud thinned to at most 1000 points."""
    stride = max(1, -(-len(record.points) // _MOST_POINTS))
    points = record.points[::stride].astype(np.float32)
    return View(step, record.time, _millimetres(record.depth), points)


def _action_sample(record: StepRecord) -> ActionSample | None:
    command = record.command
    if command is None or record.reward is None:
        return None
    distances = None
    if command.obstacles is not None:
        nearest = command.obstacles.distance[:, 0]
        distances = np.where(np.isfinite(nearest), nearest, np.nan)
    return ActionSample(
        body_distances=distances,
        twist_wanted=command.twist,
        twist_achieved=record.twist_achieved,
        slack=command.qp.row_slack if command.qp else None,
        solve_time=command.qp.solve_time if command.qp else None,
        reward=record.reward,
    )


def _millimetres(depth: DepthImage) -> NDArray[np.uint16]:
    largest = np.iinfo(np.uint16).max
    millimetres = np.rint(depth * DEPTH_UNITS_PER_METRE).clip(0, largest)
    return np.asarray(millimetres, dtype=np.uint16)
