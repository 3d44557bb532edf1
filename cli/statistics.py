"""Rates and means of trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import binomtest

from .episodes import Trial

_CONFIDENCE = 0.95


@dataclass(frozen=True)
class Share:
    """Part of the trials, with the Wilson interval of the rate behind it.

    Attributes:
        rate: In [0, 1].
        low: Lower end of the 95 % interval.
        high: Upper end.
    """

    rate: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{100 * self.rate:.0f} % [{100 * self.low:.0f}, {100 * self.high:.0f}]"


@dataclass(frozen=True)
class Summary:
    """A method in a scene. Means are over successes, as in the paper; None without any.

    Attributes:
        method: The method.
        scene: The scene.
        trials: Number of trials.
        success: Share that reached the goal.
        collision: Share that touched something.
        timeout: Share that did neither in time.
        path_length_base: Mean way of the base [m].
        path_length_ee: Mean way of the end effector [m].
        execution_time: Mean simulated time [s].
        mean_ee_speed: Mean of AV [m/s].
        min_distance: Mean of the least clearance [m].
    """

    method: str
    scene: str
    trials: int
    success: Share
    collision: Share
    timeout: Share
    path_length_base: float | None
    path_length_ee: float | None
    execution_time: float | None
    mean_ee_speed: float | None
    min_distance: float | None


def share(k: int, n: int) -> Share:
    """Rate k of n with its Wilson interval.

    Args:
        k: Trials that count.
        n: All trials, at least 1.
    """
    interval = binomtest(k, n).proportion_ci(_CONFIDENCE, method="wilson")
    return Share(k / n, float(interval.low), float(interval.high))


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
        timeout=rate("timeout"),
        path_length_base=mean("path_length_base"),
        path_length_ee=mean("path_length_ee"),
        execution_time=mean("execution_time"),
        mean_ee_speed=mean("mean_ee_speed"),
        min_distance=mean("min_distance"),
    )
