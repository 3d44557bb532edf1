"""Stable-Baselines3 models for the robot: making them, and what their memory costs."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.type_aliases import GymEnv

from sb3_bayes_dsac.common.buffers import FrameStackReplayBuffer
from sb3_bayes_dsac.common.encoders import DepthEncoder
from sb3_bayes_dsac.common.taught_buffer import TaughtReplayBuffer

from .algorithms import catalogue
from .config import TrainConfig

_MEGABYTE = 1e6


def new_model(config: TrainConfig, env: GymEnv) -> BaseAlgorithm:
    """An untrained model with the encoder and nets that all algorithms share.

    SB3's own algorithms give actor and critics an encoder each; those of `sb3_bayes_dsac` share
    one, as the paper does.

    Args:
        config: The run.
        env: Where it learns.
    """
    algorithm, networks = catalogue().algorithm(config.algo), catalogue().networks
    extra: dict[str, Any] = {}
    # Between corrections there are more frames than one: SB3's own buffer keeps whole stacks.
    if algorithm.kind == "off_policy" and config.env.action_mode == "direct":
        taught = algorithm.is_taught
        extra["replay_buffer_class"] = TaughtReplayBuffer if taught else FrameStackReplayBuffer
        # The map is an image, but no stack of frames.
        extra["replay_buffer_kwargs"] = {"stacked_keys": ["depth"]}
    if algorithm.action_noise:
        zeros = np.zeros(env.action_space.shape or (1,))
        extra["action_noise"] = NormalActionNoise(zeros, zeros + algorithm.action_noise)
    model: BaseAlgorithm = algorithm.load()(
        "MultiInputPolicy",
        env,
        policy_kwargs={
            "features_extractor_class": DepthEncoder,
            "features_extractor_kwargs": {
                "features_dim": networks.image_features,
                "multi_scale": ["deviation"] if config.encoding == "multi_scale" else [],
            },
            "net_arch": list(networks.hidden),
            **({"layer_norm": True} if config.layer_norm else {}),
        },
        seed=config.seed,
        device=config.device,
        **config.arguments(),
        **extra,
    )
    return model


def buffer_megabytes(model: BaseAlgorithm) -> float | None:
    """Size of the replay buffer when it is full [MB]; None if there is none."""
    buffer = getattr(model, "replay_buffer", None)
    if buffer is None:
        return None
    if isinstance(buffer, FrameStackReplayBuffer):
        return buffer.nbytes / _MEGABYTE
    plain = (*buffer.observations.values(), *buffer.next_observations.values())
    return float(sum(part.nbytes for part in plain) / _MEGABYTE)
