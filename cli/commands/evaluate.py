"""`horf evaluate`: methods on the frozen test instances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..exit_codes import SOME_JOBS_FAILED
from ..options import (
    EXECUTION,
    EXPERIMENT,
    OUTPUT,
    Control,
    Json,
    Limits,
    Perception,
    Simulation,
    listed,
)

if TYPE_CHECKING:
    from ..environments import EnvSettings
    from ..evaluation import Job, JobResult

_ALL = "all"


Methods = Annotated[
    str,
    typer.Option(
        help="Planners (hra) and run folders or checkpoints of your own runs, with commas.",
        rich_help_panel=EXPERIMENT,
    ),
]
Scenes = Annotated[
    str, typer.Option(help="Scenes with commas, or all.", rich_help_panel=EXPERIMENT)
]
Trials = Annotated[
    int, typer.Option(min=1, help="Instances of each scene.", rich_help_panel=EXPERIMENT)
]
Workers = Annotated[int, typer.Option(min=1, help="Processes.", rich_help_panel=EXECUTION)]
Out = Annotated[
    Path | None,
    typer.Option(help="New file for one row a trial (.csv or .parquet).", rich_help_panel=OUTPUT),
]


def evaluate(
    methods: Methods = "hra",
    scenes: Scenes = _ALL,
    trials: Trials = 50,
    control: Control = "default",
    limits: Limits = "ld60",
    perception: Perception = "camera",
    simulation: Simulation = "kinematic",
    workers: Workers = 1,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Compare methods: rates with intervals, path lengths, times, clearance.

    Trial k of a scene is test instance k with seed k for every method.
    """
    from horf_env.scenes import SCENES

    from ..environments import EnvSettings
    from ..evaluation import plan
    from ..methods import check_method
    from ..trial_files import check_target, write_trials

    names = listed(methods)
    for name in names:
        check_method(name)
    common = {
        "control": control,
        "limits": limits,
        "perception": perception,
        "simulation": simulation,
    }
    wanted = SCENES if scenes == _ALL else listed(scenes)
    settings = [EnvSettings(scene=scene, **common) for scene in wanted]
    _check(settings, trials)
    if out is not None:
        check_target(out)
    results = _run(plan(names, settings, trials), workers)
    if out is not None:
        write_trials(out, [trial for result in results for trial in result.trials])
    _report(results, as_json=as_json)


def _check(settings: Sequence[EnvSettings], trials: int) -> None:
    from ..environments import test_instances

    for env in settings:
        env.check()
        if trials > test_instances(env.scene):
            raise typer.BadParameter(
                f"scene {env.scene} has {test_instances(env.scene)} test instances",
                param_hint="--trials",
            )


def _run(jobs: Sequence[Job], workers: int) -> list[JobResult]:
    from rich.progress import Progress

    from ..console import notes
    from ..evaluation import run_jobs

    console = notes()
    with Progress(console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task("trials", total=sum(len(job.instances) for job in jobs))

        def on_result(result: JobResult) -> None:
            progress.advance(task, len(result.job.instances))
            job = result.job
            span = f"{job.method}, {job.env.scene} {job.instances[0]} to {job.instances[-1]}"
            successes = sum(trial.success for trial in result.trials)
            console.print(f"{span}: {result.error or f'{successes} reached the goal'}")

        return run_jobs(jobs, workers, on_result)


def _report(results: Sequence[JobResult], *, as_json: bool) -> None:
    from ..console import print_json
    from ..console import results as result_console
    from ..statistics import summarise_trials
    from ..tables import summary_table

    groups: dict[tuple[str, str], list[JobResult]] = {}
    for result in results:
        groups.setdefault((result.job.env.scene, result.job.method), []).append(result)
    trials = [[t for result in group for t in result.trials] for group in groups.values()]
    summaries = [summarise_trials(group) for group in trials if group]
    failed = [result for result in results if result.error]
    if as_json:
        print_json(
            {
                "summaries": [asdict(summary) for summary in summaries],
                "failed_jobs": [
                    {"method": r.job.method, "scene": r.job.env.scene, "error": r.error}
                    for r in failed
                ],
            }
        )
    else:
        result_console().print(summary_table(summaries))
    if failed:
        raise typer.Exit(SOME_JOBS_FAILED)
