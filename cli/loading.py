"""A training run read back from its newest sound checkpoint."""

from __future__ import annotations

import pickle
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from stable_baselines3.common.base_class import BaseAlgorithm

from .algorithms import catalogue
from .checkpoints import BUFFER, MODEL, STATE, Checkpoint, DamagedCheckpointError, checkpoints
from .config import TrainConfig
from .exit_codes import CliError
from .progress import Listener
from .run_state import RunState
from .runs import RunFolder
from .training_envs import TimedEnvs


@dataclass(frozen=True)
class Loaded:
    """A checkpoint that was read."""

    checkpoint: Checkpoint
    model: BaseAlgorithm
    state: RunState


def newest(
    run: RunFolder, config: TrainConfig, envs: TimedEnvs, listener: Listener
) -> Loaded | None:
    """The newest sound checkpoint, or None for a run that has to begin.

    Raises:
        CliError: If there are checkpoints, but none can be used.
    """
    found = checkpoints(run.checkpoints)
    for checkpoint in found:
        try:
            return _load(checkpoint, config, envs)
        except DamagedCheckpointError as error:
            listener.note(f"{error}: the one before is used")
    if found:
        raise CliError(f"{run.checkpoints}: no sound checkpoint is left; start a new run")
    return None


def _load(checkpoint: Checkpoint, config: TrainConfig, envs: TimedEnvs) -> Loaded:
    """Read a checkpoint; all checksums are checked before anything is unpickled."""
    buffered = catalogue().algorithm(config.algo).kind == "off_policy"
    needed = [MODEL, STATE, *([BUFFER] if buffered else [])]
    paths = {name: checkpoint.verified(name) for name in needed}
    try:
        return _unpickled(checkpoint, paths, config, envs)
    except Exception as error:  # of other versions of anything
        raise CliError(
            f"{checkpoint.path}: cannot be resumed ({type(error).__name__}: {error}); "
            "install the versions that manifest.json lists"
        ) from error


def _unpickled(
    checkpoint: Checkpoint, paths: Mapping[str, Path], config: TrainConfig, envs: TimedEnvs
) -> Loaded:
    algorithm = catalogue().algorithm(config.algo).load()
    # buffer_size=1: SB3 would allocate a whole buffer, which is replaced at once.
    size = {"buffer_size": 1} if BUFFER in paths else {}
    model = algorithm.load(paths[MODEL], env=envs, device=config.device, force_reset=False, **size)
    if BUFFER in paths:
        model.buffer_size = config.arguments()["buffer_size"]
        model.load_replay_buffer(paths[BUFFER])
    with paths[STATE].open("rb") as file:
        state = pickle.load(file)
    return Loaded(checkpoint, model, state)
