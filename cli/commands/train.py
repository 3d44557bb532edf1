"""`horf train`: one algorithm learns in one scene."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..exit_codes import INTERRUPTED, UsageError
from ..options import EXECUTION, EXPERIMENT, OUTPUT, Json, complete_scenes

if TYPE_CHECKING:
    from ..config import TrainConfig
    from ..training import RunResult

_EVALUATION = "Evaluation"
_RUNS = Path("runs")


def _complete_algorithms(incomplete: str) -> list[str]:
    from ..algorithms import catalogue

    return [name for name in catalogue().algorithms if name.startswith(incomplete)]


Algo = Annotated[
    str | None,
    typer.Option(
        help="bayes_dsac, dsac_t, sac, td3, redq, tqc or ppo.",
        show_default="bayes_dsac",
        autocompletion=_complete_algorithms,
        rich_help_panel=EXPERIMENT,
    ),
]
TrainScene = Annotated[
    str | None,
    typer.Option(
        help="aisle, room, forest, doorway, or the path of a scene file (JSON).",
        show_default="forest",
        autocompletion=complete_scenes,
        rich_help_panel=EXPERIMENT,
    ),
]
Steps = Annotated[
    int | None,
    typer.Option(
        min=1, help="Environment steps.", show_default="100000", rich_help_panel=EXPERIMENT
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(min=0, help="Seed of the run.", show_default="0", rich_help_panel=EXPERIMENT),
]
ActionLayer = Annotated[
    str | None,
    typer.Option(
        help="What an action is: sdf_qp or sampled_qp (EE twist), or joint_velocity.",
        show_default="sdf_qp",
        rich_help_panel=EXPERIMENT,
    ),
]
ReplayRatio = Annotated[
    float | None,
    typer.Option(
        help="Gradient steps an environment step.",
        show_default="0.5",
        rich_help_panel=EXPERIMENT,
    ),
]
Config = Annotated[
    Path | None,
    typer.Option(help="Settings as TOML; options and -p win.", rich_help_panel=EXPERIMENT),
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "-p",
        metavar="KEY=VALUE",
        help="Any setting: learning_rate=3e-4 (of the algorithm), env.limits=paper, "
        "protocol.every=3000, storage.keep=5. May be repeated.",
        rich_help_panel=EXPERIMENT,
    ),
]
NEnvs = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Environments, each in its own process if there are several.",
        show_default="1",
        rich_help_panel=EXECUTION,
    ),
]
Device = Annotated[
    str | None, typer.Option(help="Of torch.", show_default="cpu", rich_help_panel=EXECUTION)
]
Threads = Annotated[
    int | None,
    typer.Option(min=1, help="Threads of torch.", show_default="1", rich_help_panel=EXECUTION),
]
EvaluateEvery = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Steps between two evaluations.",
        show_default="6000",
        rich_help_panel=_EVALUATION,
    ),
]
EvaluationEpisodes = Annotated[
    int | None,
    typer.Option(min=1, help="Episodes of each.", show_default="2", rich_help_panel=_EVALUATION),
]
FinalEpisodes = Annotated[
    int | None,
    typer.Option(
        min=1, help="Episodes at the end.", show_default="20", rich_help_panel=_EVALUATION
    ),
]
Out = Annotated[Path, typer.Option(help="Folder of all runs.", rich_help_panel=OUTPUT)]
Resume = Annotated[
    Path | None,
    typer.Option(help="Go on with this run; no other setting is needed.", rich_help_panel=OUTPUT),
]
Exact = Annotated[
    bool,
    typer.Option(
        "--exact",
        help="Resume only if what follows is bit-equal to a run without interruption.",
        rich_help_panel=OUTPUT,
    ),
]
DryRun = Annotated[
    bool,
    typer.Option("--dry-run", help="Print what would run, as JSON.", rich_help_panel=OUTPUT),
]


def train(
    algo: Algo = None,
    scene: TrainScene = None,
    steps: Steps = None,
    seed: Seed = None,
    action_layer: ActionLayer = None,
    replay_ratio: ReplayRatio = None,
    config: Config = None,
    parameters: Parameters = None,
    n_envs: NEnvs = None,
    device: Device = None,
    threads: Threads = None,
    evaluate_every: EvaluateEvery = None,
    evaluation_episodes: EvaluationEpisodes = None,
    final_episodes: FinalEpisodes = None,
    out: Out = _RUNS,
    resume: Resume = None,
    exact: Exact = False,
    dry_run: DryRun = False,
    as_json: Json = False,
) -> None:
    """Train a policy. Ctrl-C stops after a checkpoint; --resume goes on.

    Makes a folder OUT/SCENE/ALGO/seedK-TIME for checkpoints, recordings of
    evaluations, metrics, TensorBoard, and manifest.json.
    """
    from ..config_files import make_config

    options = {
        "algo": algo,
        "env.scene": scene,
        "steps": steps,
        "seed": seed,
        "env.action_layer": action_layer,
        "replay_ratio": replay_ratio,
        "n_envs": n_envs,
        "device": device,
        "threads": threads,
        "protocol.every": evaluate_every,
        "protocol.episodes": evaluation_episodes,
        "protocol.final_episodes": final_episodes,
    }
    given = any(value is not None for value in options.values()) or config or parameters
    if resume is not None:
        if given:
            raise UsageError("--resume takes the settings of the run: leave all others out")
        return _resume(resume, exact=exact, as_json=as_json)
    if exact:
        raise UsageError("--exact belongs to --resume")
    made = make_config(file=config, options=options, parameters=parameters or ())
    made.check()
    if dry_run:
        return _print_plan(made, out)
    from ..runs import RunFolder

    return _run(made, RunFolder.create(out, made).path, as_json=as_json)


def _resume(path: Path, *, exact: bool, as_json: bool) -> None:
    from ..runs import RunFolder

    config = RunFolder(path).read().config
    _run(config, path, as_json=as_json, resume=True, exact=exact)


def _run(
    config: TrainConfig, folder: Path, *, as_json: bool, resume: bool = False, exact: bool = False
) -> None:
    from ..console import notes
    from ..progress import ConsoleListener
    from ..training import train as run

    console = notes()
    console.print(f"run folder: {folder}")
    with ConsoleListener(console, config.algo) as listener:
        result = run(config, folder, resume=resume, exact=exact, progress=listener)
    _report(result, as_json=as_json)


def _print_plan(config: TrainConfig, out: Path) -> None:
    from ..console import print_json

    print_json(
        {
            "folder": str(out / config.env.scene_name / config.algo / f"seed{config.seed}-<time>"),
            "config": config.model_dump(mode="json"),
            "config_hash": config.content_hash(),
            "arguments": config.arguments(),
        }
    )


def _report(result: RunResult, *, as_json: bool) -> None:
    from ..console import print_json, results
    from ..statistics import share

    success = share(result.successes, result.episodes) if result.episodes else None
    if as_json:
        print_json(
            {
                "folder": str(result.folder),
                "status": result.status,
                "steps": result.steps,
                "success": asdict(success) if success else None,
                "mean_return": result.mean_return,
            }
        )
    else:
        console = results()
        console.print(f"{result.status} after {result.steps} steps: {result.folder}")
        if success:
            console.print(f"validation success: {success} of {result.episodes} episodes")
            console.print(f"watch: horf replay {result.folder}")
        else:
            console.print(f"go on: horf train --resume {result.folder}")
    if result.status == "interrupted":
        raise typer.Exit(INTERRUPTED)
