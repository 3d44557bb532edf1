"""`horf evaluate`: methods on the frozen test instances, as the paper's Table 1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..exit_codes import SOME_JOBS_FAILED
from ..options import (
    EXPERIMENT,
    OUTPUT,
    Address,
    BackendName,
    Control,
    Json,
    Limits,
    Perception,
    Simulation,
    Workers,
    listed,
)

if TYPE_CHECKING:
    from ..backends import Backend
    from ..environments import EnvSettings
    from ..episodes import Trial
    from ..evaluation import JobResult, TrialJob

_ALL = "all"


def _complete_methods(incomplete: str) -> list[str]:
    from ..methods import POLICY_METHOD, planner_names

    return [name for name in [POLICY_METHOD, *planner_names()] if name.startswith(incomplete)]


Methods = Annotated[
    str,
    typer.Option(
        help="With commas: horf (the packaged policy), planners (hra, ...), names given by "
        "--policy, run folders of your own.",
        autocompletion=_complete_methods,
        rich_help_panel=EXPERIMENT,
    ),
]
Policies = Annotated[
    list[str] | None,
    typer.Option(
        "--policy",
        help="Weights (.safetensors) or run folder in place of horf, or NAME=PATH for another "
        "name. Can be given several times.",
        rich_help_panel=EXPERIMENT,
    ),
]
Scenes = Annotated[
    str, typer.Option(help="Scenes with commas, or all.", rich_help_panel=EXPERIMENT)
]
Trials = Annotated[
    int,
    typer.Option(
        min=1,
        help="Trials in each scene. Beyond its 50 test instances these come again, with other "
        "noise; then all depth images are noisy.",
        rich_help_panel=EXPERIMENT,
    ),
]
Fault = Annotated[
    str | None,
    typer.Option(
        help="What goes wrong: frame_dropped, frame_late, depth_noise, pixels_invalid, base_slip "
        "or velocity_lag.",
        rich_help_panel=EXPERIMENT,
    ),
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust",
        help="Load a zip of Stable-Baselines3, which may run any code.",
        rich_help_panel=EXPERIMENT,
    ),
]
Out = Annotated[
    Path,
    typer.Option(
        help="Folder for trials and tables. Trials that are there already are not run again.",
        rich_help_panel=OUTPUT,
    ),
]


def evaluate(
    methods: Methods = "hra",
    policies: Policies = None,
    scenes: Scenes = _ALL,
    trials: Trials = 50,
    control: Control = "default",
    limits: Limits = "ld60",
    perception: Perception = "camera",
    simulation: Simulation = "kinematic",
    fault: Fault = None,
    trust: Trust = False,
    backend: BackendName = "local",
    workers: Workers = 1,
    address: Address = None,
    out: Out = Path("evaluations"),
    as_json: Json = False,
) -> None:
    """Compare methods in the layout of the paper's Table 1.

    Trial k of a scene has the same instance and the same noise for every method. The table comes
    with 95 % intervals, paired tests against the first method, and the paper's own figures. OUT
    gets table.md, table.csv, table.tex and trials.parquet, one row a trial. An interrupted
    evaluation goes on where it stopped if it is started again.
    """
    from horf_env.scenes import SCENES

    from ..backends import make_backend
    from ..environments import EnvSettings
    from ..evaluation import plan
    from ..methods import parse_methods

    found = parse_methods(listed(methods), policies or [], trust=trust)
    settings = [
        EnvSettings(
            scene=scene,
            control=control,
            limits=limits,
            perception=perception,
            simulation=simulation,
            fault=fault,
        )
        for scene in (SCENES if scenes == _ALL else listed(scenes))
    ]
    for env in settings:
        env.check()
    engine = make_backend(backend, workers=workers, address=address)
    results = _run(plan(found, settings, trials), out, engine)
    _report(results, out, notes=_notes(settings, trials), as_json=as_json)


def _run(jobs: Sequence[TrialJob], out: Path, engine: Backend) -> list[JobResult]:
    from rich.progress import Progress

    from ..console import notes
    from ..evaluation import run_jobs

    stored = out / "jobs"
    stored.mkdir(parents=True, exist_ok=True)
    console = notes()
    with Progress(console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task("trials", total=sum(len(job.trials) for job in jobs))

        def on_result(result: JobResult) -> None:
            progress.advance(task, len(result.job.trials))
            job = result.job
            span = f"{job.method.name}, {job.env.scene} {job.trials[0]} to {job.trials[-1]}"
            successes = sum(trial.success for trial in result.trials)
            text = result.error or f"{successes} reached the goal"
            console.print(f"{span}: {text}{' (stored)' if result.stored else ''}", markup=False)

        return run_jobs(jobs, stored, engine, on_result)


def _report(
    results: Sequence[JobResult], out: Path, *, notes: Sequence[str], as_json: bool
) -> None:
    from ..console import results as result_console
    from ..table_formats import terminal_table, write_table
    from ..table_one import table_one
    from ..trial_files import write_trials

    trials = _grouped(results)
    failed = [result for result in results if result.error]
    rows = out / "trials.parquet"
    write_trials(rows, [trial for group in trials.values() for trial in group])
    table = table_one(trials, notes)
    files = [rows, *write_table(table, out)]
    if as_json:
        _print_json(trials, failed, files)
    else:
        console = result_console()
        console.print(terminal_table(table))
        console.print("\n".join([*table.notes, *map(str, files)]), markup=False)
    if failed:
        raise typer.Exit(SOME_JOBS_FAILED)


def _grouped(results: Sequence[JobResult]) -> dict[tuple[str, str], list[Trial]]:
    """Trials by scene and method, without groups of which every job failed."""
    groups: dict[tuple[str, str], list[Trial]] = {}
    for result in results:
        for trial in result.trials:
            groups.setdefault((trial.scene, trial.method), []).append(trial)
    return groups


def _print_json(
    trials: dict[tuple[str, str], list[Trial]],
    failed: Sequence[JobResult],
    files: Sequence[Path],
) -> None:
    from ..console import print_json
    from ..summaries import summarise_trials
    from ..table_one import paired_tests

    print_json(
        {
            "summaries": [asdict(summarise_trials(group)) for group in trials.values()],
            "paired_tests": [asdict(test) for test in paired_tests(trials)],
            "failed_jobs": [
                {"method": r.job.method.name, "scene": r.job.env.scene, "error": r.error}
                for r in failed
            ],
            "files": [str(file) for file in files],
        }
    )


def _notes(settings: Sequence[EnvSettings], trials: int) -> list[str]:
    """How the trials were made."""
    from ..environments import test_instances
    from ..evaluation import repeats

    env = settings[0]
    notes = [
        f"Control {env.control}, limits {env.limits}, perception {env.perception}, "
        f"simulation {env.simulation}, fault {env.fault or 'none'}."
    ]
    if any(repeats(env.scene, trials) for env in settings):
        notes.append(
            f"{trials} trials are {test_instances(env.scene)} instances with several noise seeds: "
            "intervals and p take them for independent, which they are not quite."
        )
    return notes
