"""What the runs of a comparison say: read from their folders, grouped by what was compared."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from horf_env.types import FloatArray

from .metrics import DamagedFileWarning, read_evaluations, read_metrics
from .q_bias import read_q_bias
from .runs import Manifest, RunFolder

_BINS = 20  # of a run's steps, for training episodes
OUTCOMES = ("success", "collision", "stuck", "timeout")


@dataclass(frozen=True)
class Points:
    """Something that was measured several times in a run.

    Attributes:
        step: Environment steps, shape (n,), rising.
        hours: Wall time of training [h], shape (n,), rising.
        value: What was measured, shape (n,).
    """

    step: FloatArray
    hours: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class RunData:
    """A run as a report needs it.

    Attributes:
        path: Its folder.
        manifest: Its manifest.
        metrics: As `read_metrics` gives them.
        evaluations: As `read_evaluations` gives them.
        q_bias: As `read_q_bias` gives it.
        damaged: What could not be read.
    """

    path: Path
    manifest: Manifest
    metrics: pa.Table
    evaluations: pa.Table
    q_bias: dict[str, Any] | None
    damaged: tuple[str, ...]

    @property
    def ratio(self) -> float | None:
        """Gradient steps an environment step; None for on-policy algorithms."""
        arguments = self.manifest.arguments
        if "train_freq" not in arguments:
            return None
        joint_steps = arguments["train_freq"] * self.manifest.config.n_envs
        return float(arguments["gradient_steps"] / joint_steps)

    @cached_property
    def final(self) -> pa.Table:
        """Episodes of the evaluation at the end; none if the run did not get there."""
        return self.evaluations.filter(pc.equal(self.evaluations["protocol"], "validation"))

    @property
    def bias(self) -> float | None:
        """Normalised bias of Q; None if it was not measured."""
        return (self.q_bias or {}).get("normalized_mean")

    @property
    def final_return(self) -> float:
        """Mean return of the evaluation at the end; nan without one."""
        return _mean(self.final["return"])

    @property
    def final_success(self) -> float:
        """Success rate of the evaluation at the end; nan without one."""
        return _mean(self.final["success"])

    @property
    def hours(self) -> float:
        """Wall time of training, evaluations included [h]."""
        return (pc.max(self.metrics["wall_time"]).as_py() or 0.0) / 3600.0

    @property
    def steps(self) -> int:
        """Environment steps that the metrics tell of."""
        return int(pc.max(self.metrics["step"]).as_py() or 0)

    def outcomes(self) -> dict[str, int]:
        """Episodes at the end by outcome."""
        found = [name or "success" for name in self.final["failure"].to_pylist()]
        return {name: found.count(name) for name in OUTCOMES}

    def evaluation_points(self, column: str) -> Points:
        """Mean of a column over each evaluation of the paper's protocol."""
        rows = self.evaluations.filter(pc.equal(self.evaluations["protocol"], "paper"))
        return _averaged(rows["step"], rows["wall_time"], rows[column], rows["step"])

    def training_points(self, name: str) -> Points:
        """Mean of a metric of training episodes over each twentieth of the run."""
        rows = self.metrics.filter(pc.equal(self.metrics["name"], name))
        width = max(self.manifest.config.steps / _BINS, 1.0)
        bins = np.ceil(rows["step"].to_numpy() / width)
        return _averaged(rows["step"], rows["wall_time"], rows["value"], pa.array(bins))


@dataclass(frozen=True)
class Group:
    """Runs that differ by their seeds only.

    Attributes:
        label: As in figures.
        algo: The algorithm.
        runs: At least one.
    """

    label: str
    algo: str
    runs: tuple[RunData, ...]

    @property
    def ratio(self) -> float | None:
        """Gradient steps an environment step; None for on-policy algorithms."""
        return self.runs[0].ratio

    @property
    def ended(self) -> list[RunData]:
        """Runs with an evaluation at the end."""
        return [run for run in self.runs if run.final.num_rows]


def read_run(path: Path) -> RunData:
    """Read a run; damaged files are left out and listed.

    Raises:
        CliError: If it is none.
    """
    manifest = RunFolder(path).read()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DamagedFileWarning)
        metrics, evaluations = read_metrics(path), read_evaluations(path)
    damaged = tuple(str(w.message) for w in caught if w.category is DamagedFileWarning)
    return RunData(path, manifest, metrics, evaluations, read_q_bias(path), damaged)


def group(runs: Sequence[RunData]) -> list[Group]:
    """Group runs by algorithm, and by replay ratio where one algorithm has several."""
    found: dict[tuple[str, float | None], list[RunData]] = {}
    for run in runs:
        found.setdefault((run.manifest.config.algo, run.ratio), []).append(run)
    several = {algo for algo, _ in found if sum(algo == other for other, _ in found) > 1}
    return [
        Group(f"{algo}, ratio {ratio:g}" if algo in several else algo, algo, tuple(members))
        for (algo, ratio), members in found.items()
    ]


def on_grid(points: Sequence[Points], axis: str) -> tuple[FloatArray, FloatArray]:
    """Curves of several runs at common places, by linear interpolation.

    Args:
        points: One a run, each with at least one point.
        axis: "step" or "hours".

    Returns:
        Places (n,), where all runs have data, and values (n, n_runs, 1); n may be 0.
    """
    places = [getattr(p, axis) for p in points]
    first, last = max(x[0] for x in places), min(x[-1] for x in places)
    grid = np.unique(np.concatenate(places))
    grid = grid[(grid >= first) & (grid <= last)]
    values = [np.interp(grid, x, p.value) for x, p in zip(places, points, strict=True)]
    return grid, np.array(values).T[:, :, None]


def _mean(column: pa.ChunkedArray) -> float:
    value = pc.mean(pc.cast(column, pa.float64())).as_py()
    return float("nan") if value is None else float(value)


def _averaged(step: Any, seconds: Any, value: Any, key: Any) -> Points:
    """Means of rows that share a key, in the order of keys; places are the last of each key."""
    table = pa.table(
        {"key": key, "step": step, "seconds": seconds, "value": pc.cast(value, pa.float64())}
    )
    means = table.group_by("key").aggregate(
        [("step", "max"), ("seconds", "max"), ("value", "mean")]
    )
    means = means.sort_by("key")
    return Points(
        step=means["step_max"].to_numpy().astype(float),
        hours=means["seconds_max"].to_numpy() / 3600.0,
        value=means["value_mean"].to_numpy(),
    )
