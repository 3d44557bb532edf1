"""Training runs of a comparison: planned by what they compute, found again, run by a backend."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from .backends import Backend
from .config import TrainConfig
from .exit_codes import CliError, UsageError
from .q_bias import is_q_bias_missing, measure_q_bias
from .runs import Manifest, RunFolder
from .training import RunResult, train


@dataclass(frozen=True, eq=False)
class TrainJob:
    """A run that is to exist, under a folder of runs.

    Attributes:
        config: What the run does.
        root: Folder of all runs.
    """

    config: TrainConfig
    root: Path

    @property
    def name(self) -> str:
        """For progress and error lists."""
        ratio = self.config.replay_ratio
        suffix = "" if ratio is None else f" ratio {ratio:g}"
        return f"{self.config.algo}{suffix} seed {self.config.seed}"


@dataclass(frozen=True)
class JobState:
    """What there is of a run.

    Attributes:
        job: The job.
        run: Its folder; None if it has not begun.
        finished: Whether nothing is left to do.
        error: Why it failed now, or "".
    """

    job: TrainJob
    run: RunFolder | None
    finished: bool
    error: str = ""


def parse_seeds(text: str) -> list[int]:
    """Seeds from "0-4" or "0,2,7-9", each once.

    Raises:
        UsageError: If it is neither.
    """
    seeds: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r"\s*(\d+)(?:-(\d+))?\s*", part)
        if not found:
            raise UsageError(f"--seeds {text}: expected numbers and ranges, as 0-4 or 0,2,7")
        first = int(found[1])
        seeds.extend(range(first, int(found[2] or first) + 1))
    if not seeds:
        raise UsageError(f"--seeds {text}: no seed in there")
    return list(dict.fromkeys(seeds))


def plan(
    base: TrainConfig,
    *,
    algos: Sequence[str],
    ratios: Sequence[float | None],
    seeds: Sequence[int],
    root: Path,
) -> list[TrainJob]:
    """Jobs for all algorithms, replay ratios and seeds; first seeds first.

    Args:
        base: What all runs share.
        algos: Names of algorithms.
        ratios: Replay ratios; None for each algorithm's own.
        seeds: Seeds.
        root: Folder of all runs.
    """
    root = root.resolve()  # workers may have another working folder
    return [
        TrainJob(base.model_copy(update={"algo": algo, "replay_ratio": ratio, "seed": seed}), root)
        for seed, ratio, algo in product(seeds, ratios, algos)
    ]


def state(job: TrainJob) -> JobState:
    """What there is of a run: a finished one, or the latest that was begun."""
    found = list(_runs(job))
    for run, manifest in reversed(found):
        if manifest.status == "finished":
            return JobState(job, run, finished=not is_q_bias_missing(run))
    return JobState(job, found[-1][0] if found else None, finished=False)


def run_jobs(
    jobs: Sequence[TrainJob], backend: Backend, on_result: Callable[[JobState], None]
) -> list[JobState]:
    """Run what is missing, and go on with what was begun.

    Args:
        jobs: The jobs.
        backend: Where they run.
        on_result: Called here for each job that ends.

    Returns:
        States in the order of jobs.
    """
    states = [state(job) for job in jobs]
    missing = [index for index, found in enumerate(states) if not found.finished]
    with closing(backend.run(run_job, [jobs[index] for index in missing])) as outcomes:
        for outcome in outcomes:
            index = missing[outcome.index]
            found = state(jobs[index])
            states[index] = JobState(jobs[index], found.run, found.finished, outcome.error)
            on_result(states[index])
    return states


def run_job(job: TrainJob) -> RunResult:
    """Train, from the last checkpoint on if there is one, and measure the bias of Q.

    Raises:
        KeyboardInterrupt: If Ctrl-C was pressed; the run can be resumed.
    """
    run = state(job).run or RunFolder.create(job.root, job.config)
    result = train(job.config, run.path, resume=True)
    if result.status == "interrupted":
        raise KeyboardInterrupt
    measure_q_bias(run)
    return result


def _runs(job: TrainJob) -> Iterator[tuple[RunFolder, Manifest]]:
    """Runs that compute the same, the oldest first; folders without a manifest are none."""
    wanted = job.config.content_hash()
    folder = job.root / job.config.env.scene_name / job.config.algo
    for path in sorted(folder.glob(f"seed{job.config.seed}-*/manifest.json")):
        run = RunFolder(path.parent)
        try:
            manifest = run.read()
        except CliError:  # of another version, or damaged: it is not this run
            continue
        if manifest.config_hash == wanted:
            yield run, manifest
