"""Many trials: planned as jobs, those that are not stored yet run by a backend.

Trial k of a scene is instance k modulo the number of test instances, with seed k. So trials beyond
that number repeat instances with another sensor noise, and all trials of such an evaluation have
noisy depth images.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from .backends import Backend
from .environments import EnvSettings, make_env, test_instances
from .episodes import Trial, run_episode
from .methods import Method, make_planner
from .provenance import git_revision
from .trial_files import read_trials, write_trials

_CHUNK = 10  # trials of a job: an environment takes about 2 s to make, a trial 5 to 20 s


@dataclass(frozen=True)
class TrialJob:
    """Some trials of one method in one scene.

    Attributes:
        method: The method.
        env: The environment; the action layer is the method's.
        trials: Numbers of the trials.
    """

    method: Method
    env: EnvSettings
    trials: tuple[int, ...]

    def file_name(self) -> str:
        """Name that tells what the trials depend on: method, environment, numbers and code."""
        content = {
            "method": [self.method.name, self.method.fingerprint],
            "env": self.env.model_dump(),
            "trials": self.trials,
            "code": [version("horf"), git_revision()],
        }
        digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
        method = Path(self.method.name).name
        return f"{self.env.scene_name}-{method}-{self.trials[0]:04d}-{digest[:16]}.parquet"


@dataclass(frozen=True)
class JobResult:
    """What came of a job.

    Attributes:
        job: The job.
        trials: Its trials; none if it failed.
        error: Why it failed, or "".
        stored: Whether it had been run before.
    """

    job: TrialJob
    trials: tuple[Trial, ...] = ()
    error: str = ""
    stored: bool = False


def plan(methods: Sequence[Method], settings: Sequence[EnvSettings], trials: int) -> list[TrialJob]:
    """Jobs for all methods in all scenes, on trials 0 to trials - 1."""
    chunks = [
        tuple(range(first, min(first + _CHUNK, trials))) for first in range(0, trials, _CHUNK)
    ]
    return [
        TrialJob(method, env.model_copy(update={"depth_noise": repeats(env.scene, trials)}), chunk)
        for env in settings
        for method in methods
        for chunk in chunks
    ]


def repeats(scene: str, trials: int) -> bool:
    """Whether so many trials meet instances of a scene more than once."""
    return trials > test_instances(scene)


def run_jobs(
    jobs: Sequence[TrialJob],
    folder: Path,
    backend: Backend,
    on_result: Callable[[JobResult], None],
) -> list[JobResult]:
    """Run the jobs whose trials are not in a folder yet, and store them there.

    Args:
        jobs: The jobs.
        folder: Where each job has a file.
        backend: Where jobs run.
        on_result: Called here for each result as it comes.

    Returns:
        Results in the order of jobs, whatever the backend.
    """
    paths = {job: folder / job.file_name() for job in jobs}
    results = {
        job: JobResult(job, tuple(trials), stored=True)
        for job, path in paths.items()
        if (trials := read_trials(path)) is not None
    }
    for result in results.values():
        on_result(result)
    missing = [job for job in jobs if job not in results]
    with closing(backend.run(run_trials, missing)) as outcomes:
        for outcome in outcomes:
            job = missing[outcome.index]
            if not outcome.error:
                write_trials(paths[job], outcome.result or ())
            results[job] = JobResult(job, outcome.result or (), outcome.error)
            on_result(results[job])
    return [results[job] for job in jobs]


def run_trials(job: TrialJob) -> tuple[Trial, ...]:
    """Run the trials of one job."""
    planner = make_planner(job.method)
    env = make_env(job.env.for_planner(planner))
    trials = tuple(
        run_episode(
            env,
            planner,
            method=job.method.name,
            scene=job.env.scene,
            instance=k % test_instances(job.env.scene),
            seed=k,
        )
        for k in job.trials
    )
    env.close()
    return trials
