"""`horf train`: one algorithm learns in one scene."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..exit_codes import INTERRUPTED, UsageError
from ..options import Json
from . import train_options as o

if TYPE_CHECKING:
    from ..config import TrainConfig
    from ..training import RunResult

_RUNS = Path("runs")


def train(
    algo: o.Algo = None,
    scene: o.Scene = None,
    steps: o.Steps = None,
    seed: o.Seed = None,
    action_layer: o.ActionLayer = None,
    control: o.Control = None,
    limits: o.Limits = None,
    perception: o.Perception = None,
    simulation: o.Simulation = None,
    replay_ratio: o.ReplayRatio = None,
    config: o.Config = None,
    parameters: o.Parameters = None,
    n_envs: o.NEnvs = None,
    device: o.Device = None,
    threads: o.Threads = None,
    evaluate_every: o.EvaluateEvery = None,
    evaluation_episodes: o.EvaluationEpisodes = None,
    final_episodes: o.FinalEpisodes = None,
    out: o.Out = _RUNS,
    resume: o.Resume = None,
    exact: o.Exact = False,
    dry_run: o.DryRun = False,
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
        "env.control": control,
        "env.limits": limits,
        "env.perception": perception,
        "env.simulation": simulation,
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
