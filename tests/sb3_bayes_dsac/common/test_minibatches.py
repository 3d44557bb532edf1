from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch as th
from gymnasium import spaces
from stable_baselines3.common.buffers import DictReplayBuffer, ReplayBuffer

from sb3_bayes_dsac.common import minibatches as module
from sb3_bayes_dsac.common.minibatches import bytes_of, minibatches

ACTION = spaces.Box(-1, 1, (1,))
VECTOR = spaces.Box(-1, 1, (3,))
DICT = spaces.Dict({"depth": spaces.Box(0, 255, (2, 4, 4), np.uint8), "state": VECTOR})


def filled(space: spaces.Space[Any]) -> ReplayBuffer:
    """A buffer with 20 transitions whose rewards are their numbers."""
    cls = DictReplayBuffer if isinstance(space, spaces.Dict) else ReplayBuffer
    buffer = cls(50, space, ACTION)
    for k in range(20):
        obs = space.sample()
        batch: Any = (
            {key: value[None] for key, value in obs.items()} if isinstance(obs, dict) else obs[None]
        )
        buffer.add(batch, batch, np.zeros((1, 1)), np.array([k]), np.array([False]), [{}])
    return buffer


@pytest.mark.parametrize("space", [VECTOR, DICT])
@pytest.mark.parametrize("at_once", [1, 3, 100])
def test_batches_are_those_of_single_samples(
    monkeypatch: pytest.MonkeyPatch, space: spaces.Space[Any], at_once: int
) -> None:
    monkeypatch.setattr(module, "SAMPLE_BYTES", at_once * 2 * 8 * bytes_of(space))
    buffer = filled(space)
    calls: list[int] = []
    sample: Callable[..., Any] = buffer.sample

    def counting(n: int, env: Any = None) -> Any:
        calls.append(n)
        return sample(n, env=env)

    monkeypatch.setattr(buffer, "sample", counting)
    np.random.seed(0)
    batches = list(minibatches(buffer, 8, 7, None))
    assert len(calls) == -(-7 // at_once)
    np.random.seed(0)
    for batch in batches:
        expected = sample(8)
        assert len(batch.rewards) == 8
        assert th.equal(batch.rewards, expected.rewards)
        if isinstance(batch.observations, dict):
            assert th.equal(batch.observations["depth"], expected.observations["depth"])
        else:
            assert th.equal(batch.observations, expected.observations)
        assert batch.discounts is None


def test_size_of_an_observation() -> None:
    assert bytes_of(DICT) == 32 + 12
