"""What the trials of a method in a scene say, as one row of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .episodes import Trial
from .statistics import Share, share

_LOW_CLEARANCE = 5  # percentile


@dataclass(frozen=True)
class Summary:
    """A method in a scene. Means are over successes, as in the paper; None without any.

    Attributes:
        method: The method.
        scene: The scene.
        trials: Number of trials.
        success: Share that reached the goal.
        collision: Share that touched something.
        stuck: Share whose time was over while the end effector stood still.
        timeout: Share whose time was over while it moved.
        path_length_base: Mean way of the base [m].
        path_length_ee: Mean way of the end effector [m].
        mean_ee_speed: Mean of AV [m/s].
        execution_time: Mean simulated time [s].
        planning_time: Mean wall time of planning in an episode [s].
        total_time: Sum of both [s].
        jerk_ee: Mean of the end effector's RMS jerk [m/s^3].
        spl: Mean over all trials of success weighted by path length; None where no planner's path
            is known.
        clearance_p5: 5th percentile of the least clearance of all trials [m].
        planning_p50: Wall time of planning a tick [ms]: median over trials of their medians.
        planning_p99: The same for their 99th percentiles.
        unsolved: Ticks in which the QP was not solved and the robot braked, over all trials.
    """

    method: str
    scene: str
    trials: int
    success: Share
    collision: Share
    stuck: Share
    timeout: Share
    path_length_base: float | None
    path_length_ee: float | None
    mean_ee_speed: float | None
    execution_time: float | None
    planning_time: float | None
    total_time: float | None
    jerk_ee: float | None
    spl: float | None
    clearance_p5: float
    planning_p50: float
    planning_p99: float
    unsolved: int


def summarise_trials(trials: Sequence[Trial]) -> Summary:
    """Summarise the trials of one method in one scene, at least one."""
    n, successes = len(trials), [trial for trial in trials if trial.success]

    def rate(outcome: str) -> Share:
        return share(sum(trial.outcome == outcome for trial in trials), n)

    def mean(name: str) -> float | None:
        values = [getattr(trial, name) for trial in successes]
        return float(np.mean(values)) if values else None

    return Summary(
        method=trials[0].method,
        scene=trials[0].scene,
        trials=n,
        success=rate("success"),
        collision=rate("collision"),
        stuck=rate("stuck"),
        timeout=rate("timeout"),
        path_length_base=mean("path_length_base"),
        path_length_ee=mean("path_length_ee"),
        mean_ee_speed=mean("mean_ee_speed"),
        execution_time=mean("execution_time"),
        planning_time=mean("planning_time"),
        total_time=mean("total_time"),
        jerk_ee=mean("jerk_ee"),
        spl=_spl(trials),
        clearance_p5=float(np.percentile([t.min_distance for t in trials], _LOW_CLEARANCE)),
        planning_p50=float(np.median([t.planning_p50 for t in trials])),
        planning_p99=float(np.median([t.planning_p99 for t in trials])),
        unsolved=sum(trial.unsolved for trial in trials),
    )


def _spl(trials: Sequence[Trial]) -> float | None:
    values = [trial.spl for trial in trials if trial.spl is not None]
    return float(np.mean(values)) if values else None
