"""Algorithms of the studies, with the hyperparameters of rl_zoo3 or of our package for it."""

from __future__ import annotations

import importlib
from copy import deepcopy
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import yaml
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.noise import NormalActionNoise

from .runs import Run

ALGORITHMS = MappingProxyType(
    {
        "bayes_dsac": "sb3_bayes_dsac:BayesDSAC",
        "dsac_t": "sb3_bayes_dsac:DSACT",
        "redq": "sb3_bayes_dsac:REDQ",
        "sac": "stable_baselines3:SAC",
        "td3": "stable_baselines3:TD3",
        "tqc": "sb3_contrib:TQC",
        "ppo": "stable_baselines3:PPO",
    }
)
# Ours are those that the package ships, so that the studies measure what its users get.
_FOLDERS: tuple[Traversable, ...] = (
    resources.files("sb3_bayes_dsac.zoo") / "hyperparams",
    Path(__file__).parents[1] / "hyperparams",
)


def hyperparameters(algorithm: str, env_id: str) -> dict[str, Any]:
    """The zoo's entry for an environment, without its budget: the task says that.

    Raises:
        FileNotFoundError: No file for this algorithm.
        KeyError: No entry for this environment.
    """
    files = [folder / f"{algorithm}.yml" for folder in _FOLDERS]
    found = next((file for file in files if file.is_file()), None)
    if found is None:
        raise FileNotFoundError(f"no {algorithm}.yml in {', '.join(map(str, _FOLDERS))}")
    entry: dict[str, Any] = yaml.safe_load(found.read_text())[env_id]
    return {key: value for key, value in entry.items() if key != "n_timesteps"}


def new_model(run: Run) -> BaseAlgorithm:
    """An untrained model on one thread of the CPU."""
    # A copy: Stable-Baselines3 adds to the dictionaries that it is given.
    arguments = hyperparameters(run.algorithm, run.task.env_id) | deepcopy(run.arguments)
    env = make_vec_env(run.task.env_id, n_envs=arguments.pop("n_envs", 1), seed=run.seed)
    if arguments.pop("noise_type", None) == "normal":
        zeros = np.zeros(env.action_space.shape or (1,))
        arguments["action_noise"] = NormalActionNoise(zeros, zeros + arguments.pop("noise_std"))
    module, name = ALGORITHMS[run.algorithm].split(":")
    cls = getattr(importlib.import_module(module), name)
    model: BaseAlgorithm = cls(env=env, seed=run.seed, device="cpu", **arguments)
    return model
