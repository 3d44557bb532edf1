"""A training run from its configuration to its last checkpoint."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import torch as th
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.monitor import Monitor

from .algorithms import OffPolicy, catalogue
from .callbacks import CheckInterruption, Evaluate, ShowProgress
from .environments import Env, EnvSettings, make_env
from .episodes import Trial
from .interruption import Interruption
from .models import buffer_megabytes, new_model, save_model
from .runs import Protocol, RunConfig, RunFolder, Status


@dataclass(frozen=True)
class TrainingResult:
    """What came of a run.

    Attributes:
        folder: Where everything is.
        status: "completed", or "interrupted" by Ctrl-C.
        steps: Steps done.
        trials: Validation episodes at the end; none if it was interrupted.
    """

    folder: RunFolder
    status: Status
    steps: int
    trials: list[Trial]


def run_config(
    *,
    algo: str,
    env: EnvSettings,
    steps: int,
    seed: int,
    threads: int,
    buffer_size: int | None,
    protocol: Protocol,
) -> RunConfig:
    """Complete the settings of a run with the arguments of its algorithm.

    Args:
        algo: Name of the algorithm.
        env: The environment.
        steps: Environment steps.
        seed: Of everything random.
        threads: Threads of torch.
        buffer_size: Instead of the catalogue's; None to keep that.
        protocol: Evaluation.

    Raises:
        UnknownNameError: If there is no such algorithm.
    """
    arguments = catalogue().arguments(algo, steps)
    if buffer_size is not None and isinstance(arguments, OffPolicy):
        arguments = arguments.model_copy(update={"buffer_size": buffer_size})
    return RunConfig(
        algo=algo,
        arguments=arguments.model_dump(),
        env=env,
        steps=steps,
        seed=seed,
        threads=threads,
        protocol=protocol,
    )


def train(config: RunConfig, root: Path, console: Console) -> TrainingResult:
    """Train, evaluate, store.

    Args:
        config: What to do.
        root: Folder of all runs.
        console: For progress and notes.

    Raises:
        UnknownNameError: If a name in the configuration is not valid; no folder is made then.
        MemoryError: If the replay buffer does not fit; no folder is made then.
        OSError: If the run cannot be stored.
    """
    th.set_num_threads(config.threads)
    env, evaluation_env = make_env(config.env), make_env(config.env)
    _announce_buffer(config, env, console)
    model = new_model(config, catalogue(), env)
    folder = RunFolder.create(root, config)
    console.print(f"run folder: {folder.path}")
    model.set_env(Monitor(env, str(folder.path / "monitor.csv"), info_keywords=("is_success",)))
    model.set_logger(configure(str(folder.logs), ["csv", "tensorboard"]))
    with Interruption() as interruption, _progress(console) as progress:
        evaluate = Evaluate(
            evaluation_env, folder, config, progress=progress, interruption=interruption
        )
        callbacks = [CheckInterruption(interruption), ShowProgress(progress, config), evaluate]
        status, trials = _learn(model, config, callbacks, evaluate)
    env.close()
    evaluation_env.close()
    return TrainingResult(folder, status, model.num_timesteps, trials)


def _learn(
    model: BaseAlgorithm, config: RunConfig, callbacks: list[BaseCallback], evaluate: Evaluate
) -> tuple[Status, list[Trial]]:
    """Learn and evaluate; the last checkpoint and the manifest are right in any case."""
    status: Status = "failed"
    trials: list[Trial] = []
    try:
        # Logged after each episode: these are few and long.
        model.learn(config.steps, callbacks, log_interval=1)
        trials = evaluate.evaluate(config.protocol.final_episodes, "final")
        status = "completed"
    except KeyboardInterrupt:
        save_model(model, evaluate.folder.last)
        status = "interrupted"
    finally:
        evaluate.folder.finish(status, model.num_timesteps)
    return status, trials


def _announce_buffer(config: RunConfig, env: Env, console: Console) -> None:
    size = config.arguments.get("buffer_size")
    if size is not None:
        megabytes = buffer_megabytes(env.observation_space, size)
        console.print(f"replay buffer: {size} transitions, {megabytes:.0f} MB when full")


def _progress(console: Console) -> Progress:
    """Bars for a terminal."""
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[success]}"),
        console=console,
        disable=not console.is_terminal,
    )
