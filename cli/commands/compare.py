"""`horf compare`: several algorithms, several seeds, one report."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..exit_codes import SOME_JOBS_FAILED, UsageError
from ..options import (
    EXECUTION,
    EXPERIMENT,
    OUTPUT,
    SCENE,
    Address,
    BackendName,
    Json,
    listed,
)

if TYPE_CHECKING:
    from ..backends import Backend
    from ..comparison import JobState, TrainJob
    from ..config import TrainConfig

# A run of one algorithm in less than a minute, with everything that a long one has.
_SMOKE = {"steps": 200, "protocol.every": 200, "protocol.episodes": 1, "protocol.final_episodes": 1}
_SEEDS, _SMOKE_SEEDS = "0-4", "0"
_EVALUATIONS = 5  # of a run that is too short for the paper's one in 6000 steps


def _complete_algorithms(incomplete: str) -> list[str]:
    from ..algorithms import catalogue

    done, _, last = incomplete.rpartition(",")
    prefix = f"{done}," if done else ""
    return [prefix + name for name in catalogue().algorithms if name.startswith(last)]


Algos = Annotated[
    str,
    typer.Option(
        help="Algorithms with commas; the first is what the others are compared with.",
        autocompletion=_complete_algorithms,
        rich_help_panel=EXPERIMENT,
    ),
]
Seeds = Annotated[
    str | None,
    typer.Option(help="As 0-4, or 0,2,7.", show_default="0-4", rich_help_panel=EXPERIMENT),
]
CompareScene = Annotated[str, SCENE]
Steps = Annotated[
    int, typer.Option(min=1, help="Environment steps a run.", rich_help_panel=EXPERIMENT)
]
Ratios = Annotated[
    str,
    typer.Option(
        help="Gradient steps an environment step, with commas; by default the algorithm's own.",
        rich_help_panel=EXPERIMENT,
    ),
]
Config = Annotated[
    Path | None,
    typer.Option(help="Settings of all runs as TOML; options win.", rich_help_panel=EXPERIMENT),
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "-p",
        metavar="KEY=VALUE",
        help="Any setting of all runs, as for `horf train`. May be repeated.",
        rich_help_panel=EXPERIMENT,
    ),
]
Smoke = Annotated[
    bool,
    typer.Option(
        "--smoke",
        help="Go through everything with runs of 200 steps and one seed: is all in place?",
        rich_help_panel=EXPERIMENT,
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Runs at a time, one thread each.",
        show_default="the machine's cores",
        rich_help_panel=EXECUTION,
    ),
]
DryRun = Annotated[
    bool,
    typer.Option(
        "--dry-run", help="List the runs and how long they will take.", rich_help_panel=OUTPUT
    ),
]
Out = Annotated[Path, typer.Option(help="Folder of all runs.", rich_help_panel=OUTPUT)]
Report = Annotated[
    Path, typer.Option(help="Folder for the report; replaced.", rich_help_panel=OUTPUT)
]


def compare(
    algos: Algos = "bayes_dsac,sac,td3,ppo,tqc,redq,dsac_t",
    seeds: Seeds = None,
    steps: Steps = 100_000,
    replay_ratios: Ratios = "",
    scene: CompareScene = "forest",
    config: Config = None,
    parameters: Parameters = None,
    smoke: Smoke = False,
    backend: BackendName = "local",
    workers: Workers = None,
    address: Address = None,
    out: Out = Path("runs"),
    report: Report = Path("report"),
    dry_run: DryRun = False,
    as_json: Json = False,
) -> None:
    """Train several algorithms with several seeds, and write a report.

    Runs that are finished are not run again, those that were stopped go on. So after Ctrl-C or a
    power cut: type the same command. A run that fails is tried once more, then listed.
    """
    from ..backends import make_backend
    from ..comparison import parse_seeds, plan
    from ..config_files import make_config

    options: dict[str, Any] = {"env.scene": scene, "steps": steps, **(_SMOKE if smoke else {})}
    base = _evaluated(make_config(file=config, options=options, parameters=parameters or ()))
    jobs = plan(
        base,
        algos=listed(algos),
        ratios=_ratios(replay_ratios),
        seeds=parse_seeds(seeds or (_SMOKE_SEEDS if smoke else _SEEDS)),
        root=out,
    )
    for job in jobs:
        job.config.check()
    count = workers or os.cpu_count() or 1
    engine = make_backend(backend, workers=count, address=address)
    if dry_run:
        return _print_plan(jobs, count, as_json=as_json)
    states = _run(jobs, engine)
    _report(states, report, as_json=as_json)


def _evaluated(config: TrainConfig) -> TrainConfig:
    """The same; a run shorter than the time between two evaluations gets closer ones."""
    if config.protocol.every <= config.steps:
        return config
    every = max(config.steps // _EVALUATIONS, 1)
    protocol = config.protocol.model_copy(update={"every": every})
    return config.model_copy(update={"protocol": protocol})


def _ratios(text: str) -> list[float | None]:
    if not text:
        return [None]
    try:
        return [float(part) for part in listed(text)]
    except ValueError:
        raise UsageError(f"--replay-ratios {text}: expected numbers, as 1,20") from None


def _print_plan(jobs: Sequence[TrainJob], workers: int, *, as_json: bool) -> None:
    from rich.table import Table

    from ..comparison import state
    from ..console import notes, print_json, results
    from ..estimates import seconds_per_step

    states = [state(job) for job in jobs]
    missing = [found.job for found in states if not found.finished]
    speeds = seconds_per_step(missing, notes().print)
    seconds = {job: speed * job.config.steps for job, speed in speeds.items()}
    rows = [
        {
            "run": found.job.name,
            "hash": found.job.config.content_hash(),
            "state": "finished" if found.finished else "begun" if found.run else "new",
            "minutes": round(seconds.get(found.job, 0.0) / 60.0, 1),
        }
        for found in states
    ]
    total = round(sum(seconds.values()) / 60.0 / workers, 1)
    if as_json:
        print_json({"jobs": rows, "workers": workers, "minutes": total})
        return
    table = Table("run", "hash", "state", "minutes")
    for row in rows:
        table.add_row(*map(str, row.values()))
    results().print(table)
    results().print(
        f"about {total:g} min with {workers} at a time, if all have a core of their own"
    )


def _run(jobs: Sequence[TrainJob], engine: Backend) -> list[JobState]:
    from ..compare_progress import CompareProgress
    from ..comparison import run_jobs
    from ..console import notes

    with CompareProgress(notes(), jobs) as progress:
        return run_jobs(jobs, engine, progress.ended)


def _report(states: Sequence[JobState], folder: Path, *, as_json: bool) -> None:
    from ..console import notes, print_json, results
    from ..report import write_report

    failed = [found for found in states if found.error]
    runs = [found.run.path for found in states if found.run is not None]
    files = write_report(
        runs,
        folder,
        command=shlex.join(["horf", *sys.argv[1:]]),
        failed={found.job.name: found.error for found in failed},
    )
    if as_json:
        print_json(
            {
                "runs": [str(run) for run in runs],
                "failed_jobs": [{"run": f.job.name, "error": f.error} for f in failed],
                "files": [str(file) for file in files],
            }
        )
    else:
        results().print("\n".join(map(str, files)), markup=False)
    if failed:
        for found in failed:
            notes().print(f"failed: {found.job.name}: {found.error}", markup=False)
        raise typer.Exit(SOME_JOBS_FAILED)
