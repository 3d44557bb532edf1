"""`horf train`: one algorithm learns in one scene."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..exit_codes import INTERRUPTED
from ..options import (
    EXECUTION,
    EXPERIMENT,
    OUTPUT,
    Control,
    Json,
    Limits,
    Perception,
    Scene,
    Simulation,
)

if TYPE_CHECKING:
    from ..environments import EnvSettings
    from ..training import TrainingResult

_EVALUATION = "Evaluation"


def _complete_algorithms(incomplete: str) -> list[str]:
    from ..algorithms import catalogue

    return [name for name in catalogue().algorithms if name.startswith(incomplete)]


Algo = Annotated[
    str,
    typer.Option(
        help="bayes_dsac, dsac_t, sac, td3, tqc or ppo.",
        autocompletion=_complete_algorithms,
        rich_help_panel=EXPERIMENT,
    ),
]
Steps = Annotated[int, typer.Option(min=1, help="Environment steps.", rich_help_panel=EXPERIMENT)]
Seed = Annotated[int, typer.Option(min=0, help="Seed of the run.", rich_help_panel=EXPERIMENT)]
ActionLayer = Annotated[
    str,
    typer.Option(
        help="What an action is: sdf_qp (EE twist) or joint_velocity.", rich_help_panel=EXPERIMENT
    ),
]
EvaluateEvery = Annotated[
    int, typer.Option(min=1, help="Steps between two evaluations.", rich_help_panel=_EVALUATION)
]
EvaluationEpisodes = Annotated[
    int, typer.Option(min=1, help="Episodes of each.", rich_help_panel=_EVALUATION)
]
FinalEpisodes = Annotated[
    int, typer.Option(min=1, help="Episodes at the end.", rich_help_panel=_EVALUATION)
]
BufferSize = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Transitions in the replay buffer, 31 kB each; by default STEPS, but 50,000 at most.",
        rich_help_panel=EXECUTION,
    ),
]
Threads = Annotated[int, typer.Option(min=1, help="Threads of torch.", rich_help_panel=EXECUTION)]
Out = Annotated[Path, typer.Option(help="Folder of all runs.", rich_help_panel=OUTPUT)]


def train(
    algo: Algo = "bayes_dsac",
    scene: Scene = "forest",
    steps: Steps = 100_000,
    seed: Seed = 0,
    action_layer: ActionLayer = "sdf_qp",
    control: Control = "default",
    limits: Limits = "ld60",
    perception: Perception = "camera",
    simulation: Simulation = "kinematic",
    evaluate_every: EvaluateEvery = 6000,
    evaluation_episodes: EvaluationEpisodes = 2,
    final_episodes: FinalEpisodes = 20,
    buffer_size: BufferSize = None,
    threads: Threads = 1,
    out: Out = Path("runs"),
    as_json: Json = False,
) -> None:
    """Train a policy. Ctrl-C stops after a checkpoint.

    Makes a folder OUT/SCENE/ALGO/seedK-TIME for checkpoints, recordings of
    evaluations, TensorBoard and CSV logs, and manifest.json.
    """
    from ..environments import EnvSettings

    env = EnvSettings(
        scene=scene,
        action_layer=action_layer,
        control=control,
        limits=limits,
        perception=perception,
        simulation=simulation,
    )
    _check(algo, env, max(evaluation_episodes, final_episodes))
    from ..console import notes
    from ..runs import Protocol
    from ..training import run_config
    from ..training import train as run

    protocol = Protocol(
        every=evaluate_every, episodes=evaluation_episodes, final_episodes=final_episodes
    )
    config = run_config(
        algo=algo,
        env=env,
        steps=steps,
        seed=seed,
        threads=threads,
        buffer_size=buffer_size,
        protocol=protocol,
    )
    _report(run(config, out, notes()), as_json=as_json)


def _check(algo: str, env: EnvSettings, episodes: int) -> None:
    """Refuse wrong names and numbers before torch is imported and anything is made."""
    from horf_env.scenes import SCENES, validation_instance

    from ..algorithms import catalogue

    catalogue().algorithm(algo)
    env.check()
    if env.scene in SCENES:
        validation_instance(env.scene, episodes - 1)


def _report(result: TrainingResult, *, as_json: bool) -> None:
    from ..console import print_json, results
    from ..statistics import share

    successes = sum(trial.success for trial in result.trials)
    success = share(successes, len(result.trials)) if result.trials else None
    if as_json:
        print_json(
            {
                "folder": str(result.folder.path),
                "status": result.status,
                "steps": result.steps,
                "success": asdict(success) if success else None,
            }
        )
    else:
        console = results()
        console.print(f"{result.status} after {result.steps} steps")
        console.print(f"last checkpoint: {result.folder.last}")
        console.print(f"watch: horf replay {result.folder.path}")
        if success:
            console.print(f"validation success: {success} of {len(result.trials)} episodes")
    if result.status == "interrupted":
        raise typer.Exit(INTERRUPTED)
