"""Small models and environments for the tests of the algorithms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from gymnasium import spaces
from stable_baselines3.common.logger import configure

from sb3_bayes_dsac import BayesDSAC
from sb3_bayes_dsac.common.soft_actor_critic import SoftActorCritic

SMALL: dict[str, Any] = {
    "learning_starts": 40,
    "buffer_size": 1_000,
    "batch_size": 32,
    "seed": 0,
    "gradient_steps": 1,
    "device": "cpu",
}


@pytest.fixture(autouse=True)
def one_thread() -> None:
    th.set_num_threads(1)


class DepthReach(gym.Env[dict[str, Any], np.ndarray]):
    """Random depth stacks, two vectors, reward for small actions; episodes of 20 steps."""

    def __init__(self, height: int = 24, width: int = 32) -> None:
        self.observation_space = spaces.Dict(
            {
                "depth": spaces.Box(0, 255, (5, height, width), np.uint8),
                "state": spaces.Box(-1, 1, (7,)),
                "deviation": spaces.Box(-1, 1, (2, 3)),
            }
        )
        self.action_space = spaces.Box(-1, 1, (6,))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        super().reset(seed=seed)
        if seed is not None:
            self.observation_space.seed(seed)
        self._steps = 0
        return self.observation_space.sample(), {}

    def step(self, action: np.ndarray) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        self._steps += 1
        reward = -float(np.square(action).sum())
        return self.observation_space.sample(), reward, False, self._steps >= 20, {}


@pytest.fixture
def depth_env() -> Callable[..., gym.Env[Any, Any]]:
    return DepthReach


MakeModel = Callable[..., SoftActorCritic]


@pytest.fixture
def make_model() -> MakeModel:
    """Build a model with small networks; `policy_kwargs` adds to them."""

    def make(
        cls: type[SoftActorCritic] = BayesDSAC,
        policy: str = "MlpPolicy",
        env: Any = "Pendulum-v1",
        policy_kwargs: dict[str, Any] | None = None,
        **kwargs: Any,
    ) -> SoftActorCritic:
        net = {"net_arch": [16, 16]} | (policy_kwargs or {})
        return cls(policy, env, policy_kwargs=net, **(SMALL | kwargs))

    return make


@pytest.fixture
def fill() -> Callable[[SoftActorCritic, int], None]:
    """Put random transitions into a model's buffer and give it a silent logger."""

    def put(model: SoftActorCritic, n: int) -> None:
        assert model.env is not None
        assert model.replay_buffer is not None
        rng = np.random.default_rng(0)
        model.observation_space.seed(0)
        for _ in range(n):
            obs, next_obs = model.observation_space.sample(), model.observation_space.sample()
            if isinstance(obs, dict):
                obs, next_obs = ({k: v[None] for k, v in o.items()} for o in (obs, next_obs))
            action = rng.uniform(-1, 1, (1, *(model.action_space.shape or ())))
            done = np.array([rng.random() < 0.3])
            model.replay_buffer.add(obs, next_obs, action, rng.normal(size=1), done, [{}])
        model.set_logger(configure(None, []))

    return put
