from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch as th
from gymnasium import spaces
from sb3_contrib import TQC
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.preprocessing import preprocess_obs

from sb3_bayes_dsac.common.encoders import DepthEncoder
from sb3_bayes_dsac.errors import ArgumentError


def depth_space(height: int, width: int) -> spaces.Dict:
    return spaces.Dict(
        {
            "state": spaces.Box(-1, 1, (3,)),
            "depth": spaces.Box(0, 255, (5, height, width), np.uint8),
            "goal": spaces.Box(-1, 1, (2, 2)),
        }
    )


def encode(encoder: DepthEncoder, space: spaces.Dict, **changes: Any) -> th.Tensor:
    space.seed(0)
    obs = {key: th.as_tensor(np.stack([value] * 4)) for key, value in space.sample().items()}
    with th.no_grad():
        features: th.Tensor = encoder(preprocess_obs(obs | changes, space))
    return features


@pytest.mark.parametrize("size", [(48, 64), (24, 32), (4, 4), (37, 41)])
def test_one_image_becomes_32_numbers_beside_the_vectors(size: tuple[int, int]) -> None:
    space = depth_space(*size)
    encoder = DepthEncoder(space)
    features = encode(encoder, space)
    assert features.shape == (4, encoder.features_dim) == (4, 32 + 3 + 4)
    assert features[:, :32].abs().max() <= 1.0


def test_vectors_pass_unchanged_and_every_frame_counts() -> None:
    space = depth_space(24, 32)
    encoder = DepthEncoder(space, features_dim=8)
    state, goal = th.randn(4, 3), th.randn(4, 2, 2)
    features = encode(encoder, space, state=state, goal=goal)
    vectors = {tuple(row.tolist()) for row in features[:, 8:].T}
    assert {tuple(row.tolist()) for row in th.cat([state, goal.flatten(1)], dim=1).T} == vectors
    for frame in range(5):
        image = th.zeros(4, 5, 24, 32, dtype=th.uint8)
        black = encode(encoder, space, depth=image)
        image[:, frame] = 255
        assert not th.allclose(encode(encoder, space, depth=image), black)


def test_a_vector_of_many_scales_is_also_squashed() -> None:
    space = depth_space(24, 32)
    encoder = DepthEncoder(space, features_dim=8, multi_scale=["state"])
    state = th.randn(4, 3)
    features = encode(encoder, space, state=state)
    assert features.shape == (4, encoder.features_dim) == (4, 8 + 3 + 4 + 6)
    expected = th.cat([th.tanh(state / 0.1), th.tanh(state)], dim=1)
    th.testing.assert_close(features[:, -6:], expected)


def test_only_vectors_have_scales() -> None:
    with pytest.raises(ArgumentError, match="multi_scale"):
        DepthEncoder(depth_space(24, 32), multi_scale=["depth"])


@pytest.mark.parametrize(
    "space",
    [
        spaces.Box(0, 255, (5, 24, 32), np.uint8),
        spaces.Dict({"state": spaces.Box(-1, 1, (3,))}),
        depth_space(3, 32),
    ],
)
def test_unusable_observations_are_named(space: spaces.Space[Any]) -> None:
    with pytest.raises(ArgumentError, match="observation_space"):
        DepthEncoder(space)


@pytest.mark.parametrize("cls", [SAC, TD3, TQC, PPO])
def test_serves_other_algorithms(cls: type[Any], depth_env: type[Any]) -> None:
    kwargs: dict[str, Any] = {"n_steps": 32} if cls is PPO else {"learning_starts": 20}
    if cls is not PPO:
        kwargs["buffer_size"] = 200
    policy_kwargs = {"features_extractor_class": DepthEncoder, "net_arch": [16]}
    model = cls(
        "MultiInputPolicy", depth_env(), batch_size=16, policy_kwargs=policy_kwargs, **kwargs
    )
    model.learn(32)
    assert any(isinstance(module, DepthEncoder) for module in model.policy.modules())
