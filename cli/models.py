"""Stable-Baselines3 models for the robot: making them, saving them, what their memory costs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise

from sb3_bayes_dsac.common.encoders import DepthEncoder

from .algorithms import Catalogue
from .runs import RunConfig

_MEGABYTE = 1e6


def new_model(config: RunConfig, catalogue: Catalogue, env: gym.Env[Any, Any]) -> BaseAlgorithm:
    """An untrained model with the encoder and nets that all algorithms share.

    SB3's own algorithms give actor and critics an encoder each; those of `sb3_bayes_dsac` share
    one, as the paper does.

    Args:
        config: The run.
        catalogue: Where its algorithm is looked up.
        env: Where it learns.
    """
    algorithm, networks = catalogue.algorithm(config.algo), catalogue.networks
    extra: dict[str, Any] = {}
    if algorithm.action_noise:
        zeros = np.zeros(env.action_space.shape or (1,))
        extra["action_noise"] = NormalActionNoise(zeros, zeros + algorithm.action_noise)
    model: BaseAlgorithm = algorithm.load()(
        "MultiInputPolicy",
        env,
        policy_kwargs={
            "features_extractor_class": DepthEncoder,
            "features_extractor_kwargs": {"features_dim": networks.image_features},
            "net_arch": list(networks.hidden),
        },
        seed=config.seed,
        **config.arguments,
        **extra,
    )
    return model


def buffer_megabytes(observations: spaces.Space[Any], n: int) -> float:
    """Size of a replay buffer that stores n observations and their successors [MB]."""
    size = sum(part.nbytes for part in observations.sample().values())
    return float(2 * n * size / _MEGABYTE)


def save_model(model: BaseAlgorithm, path: Path) -> None:
    """Write a checkpoint; under its name there is a complete one at any time.

    Raises:
        OSError: If it cannot be written.
    """
    unfinished = path.with_name(f".{path.name}.part")
    model.save(unfinished)
    os.replace(unfinished, path)
