"""Trained policies as methods beside the planners."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from horf_env.types import FloatArray

from .algorithms import catalogue
from .environments import Env
from .exit_codes import CliError
from .runs import RunFolder


class PolicyPlanner:
    """A model that acts without noise; see `horf_env.planners.Planner`."""

    def __init__(self, model: BaseAlgorithm, action_layer: str) -> None:
        self._model, self.action_layer = model, action_layer

    def reset(self, env: Env) -> None:
        """Nothing to forget: the depth frames of the observation are the memory."""

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """Mean action of the policy."""
        action, _ = self._model.predict(observation, deterministic=True)
        return action


def load_policy(path: Path) -> PolicyPlanner:
    """Load a policy of one's own: Stable-Baselines3 unpickles, so a file can run any code.

    Args:
        path: Run folder (its best checkpoint, or the last if there is no best), or a checkpoint
            inside of a run folder.

    Raises:
        CliError: If it is neither, or the checkpoint cannot be loaded.
    """
    run = RunFolder.around(path)
    config = run.read().config
    file = path if path.is_file() else run.best if run.best.exists() else run.last
    try:
        model = catalogue().algorithm(config.algo).load().load(file, device="cpu")
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise CliError(f"{file}: no checkpoint of {config.algo} ({error})") from error
    return PolicyPlanner(model, config.env.action_layer)
