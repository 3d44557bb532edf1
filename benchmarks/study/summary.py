"""Groups of runs that differ in their seed alone, and what their curves say."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from horf_cli.statistics import bootstrap_interval, interquartile_mean
from numpy.typing import NDArray

from .records import read

_SEED = 0  # of the bootstrap


@dataclass(frozen=True)
class Group:
    """All runs of one algorithm (and variant) on one task.

    Attributes:
        task: Name of the task.
        algorithm: Name of the algorithm.
        variant: Name of the variant; may be empty.
        steps: Environment steps of the evaluations, shape (n_points,).
        returns: Mean return of each evaluation, shape (n_points, n_runs).
        last: Last row of each run that has one.
        stopped: Runs that did not reach their end, with the reason.
    """

    task: str
    algorithm: str
    variant: str
    steps: NDArray[np.int64]
    returns: NDArray[np.float64]
    last: list[dict[str, Any]]
    stopped: list[str]

    def last_median(self, column: str) -> float | None:
        """Median over runs of a column at the end; None if no run has it."""
        values = [row[column] for row in self.last if row[column] is not None]
        return float(np.median(values)) if values else None


@dataclass(frozen=True)
class Estimate:
    """Interquartile mean over runs with its 95 % stratified bootstrap interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.0f} [{self.low:.0f}, {self.high:.0f}]"


def estimate(curves: NDArray[np.float64]) -> list[Estimate]:
    """Estimates over runs, one a point.

    Args:
        curves: Shape (n_points, n_runs).
    """
    # One task is one stratum.
    runs = curves[..., None]
    low, high = bootstrap_interval(runs, interquartile_mean, np.random.default_rng(_SEED))
    values = interquartile_mean(runs)
    return [Estimate(*map(float, point)) for point in zip(values, low, high, strict=True)]


def groups(folder: Path) -> list[Group]:
    """All runs of a study in groups, in the order of task, variant and algorithm.

    A run that stopped before its end keeps its last return for the evaluations that it missed.
    """
    runs: dict[tuple[str, str, str], list[tuple[dict[str, Any], list[dict[str, Any]]]]] = {}
    for run, rows in read(folder):
        key = run["task"]["name"], run["variant"], run["algorithm"]
        runs.setdefault(key, []).append((run, rows))
    return [_group(key, members) for key, members in sorted(runs.items())]


def _group(
    key: tuple[str, str, str], runs: list[tuple[dict[str, Any], list[dict[str, Any]]]]
) -> Group:
    task, variant, algorithm = key
    steps = max(([row["step"] for row in rows] for _, rows in runs), key=len)
    curves = []
    for _, rows in runs:
        # Not a number if it stopped before its first evaluation: then nothing is known of it.
        curve = [float(np.mean(row["returns"])) for row in rows] or [np.nan]
        curves.append(curve + curve[-1:] * (len(steps) - len(curve)))
    return Group(
        task,
        algorithm,
        variant,
        np.array(steps),
        np.array(curves).T,
        [rows[-1] for _, rows in runs if rows],
        [run["end"] for run, _ in runs if run["end"] != "completed"],
    )
