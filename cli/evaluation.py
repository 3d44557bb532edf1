"""Many trials: planned as jobs, run in this process or in several."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass

from .environments import EnvSettings, make_env
from .episodes import Trial, run_episode
from .methods import make_planner

_CHUNK = 10  # instances of a job: an environment takes about 1 s to make, a trial 5 to 20 s


@dataclass(frozen=True)
class Job:
    """Some instances for one method in one scene.

    Attributes:
        method: Name of the method.
        env: The environment; the action layer is the method's.
        instances: Numbers of test instances.
    """

    method: str
    env: EnvSettings
    instances: tuple[int, ...]


@dataclass(frozen=True)
class JobResult:
    """What came of a job.

    Attributes:
        job: The job.
        trials: Its trials; none if it failed.
        error: Why it failed, or "".
    """

    job: Job
    trials: tuple[Trial, ...] = ()
    error: str = ""


def plan(methods: Sequence[str], settings: Sequence[EnvSettings], trials: int) -> list[Job]:
    """Jobs for all methods in all scenes, on test instances 0 to trials - 1."""
    chunks = [
        tuple(range(first, min(first + _CHUNK, trials))) for first in range(0, trials, _CHUNK)
    ]
    return [Job(method, env, chunk) for env in settings for method in methods for chunk in chunks]


def run_jobs(
    jobs: Sequence[Job], workers: int, on_result: Callable[[JobResult], None]
) -> list[JobResult]:
    """Run jobs; results are in the order of jobs, whatever the number of workers.

    Args:
        jobs: The jobs.
        workers: Processes; 1 for this one.
        on_result: Called here for each result as it comes.
    """
    results: dict[Job, JobResult] = {}
    for result in _serial(jobs) if workers == 1 else _parallel(jobs, workers):
        results[result.job] = result
        on_result(result)
    return [results[job] for job in jobs]


def run_job(job: Job) -> JobResult:
    """Run one job; an error of any kind is its result, so that the others go on."""
    try:
        return JobResult(job, trials=_trials(job))
    except Exception as error:
        return JobResult(job, error=f"{type(error).__name__}: {error}")


def _trials(job: Job) -> tuple[Trial, ...]:
    planner = make_planner(job.method)
    env = make_env(job.env.model_copy(update={"action_layer": planner.action_layer}))
    trials = tuple(
        run_episode(env, planner, method=job.method, scene=job.env.scene, instance=instance)
        for instance in job.instances
    )
    env.close()
    return trials


def _serial(jobs: Sequence[Job]) -> Iterator[JobResult]:
    yield from map(run_job, jobs)


def _parallel(jobs: Sequence[Job], workers: int) -> Iterator[JobResult]:
    # Spawned and not forked: a forked copy of PyBullet or torch may hang.
    context = multiprocessing.get_context("spawn")
    # Ctrl-C in a terminal reaches all processes: workers end at once and silently.
    die = (signal.SIGINT, signal.SIG_DFL)
    pool = ProcessPoolExecutor(workers, context, initializer=signal.signal, initargs=die)
    try:
        futures = {pool.submit(run_job, job): job for job in jobs}
        for future in as_completed(futures):
            error = future.exception()  # a worker that died
            yield JobResult(futures[future], error=repr(error)) if error else future.result()
    finally:
        pool.shutdown(cancel_futures=True)  # after Ctrl-C nothing new begins
