"""Batches for many gradient steps, sampled together where that is cheaper."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import torch as th
from gymnasium import spaces
from stable_baselines3.common.buffers import BaseBuffer
from stable_baselines3.common.type_aliases import DictReplayBufferSamples, ReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize

# Bytes of observations that are sampled at once. One call for many batches saves overhead, but
# beyond the second-level cache it only moves memory twice.
SAMPLE_BYTES: Final = 4_000_000


def minibatches(
    buffer: BaseBuffer, batch_size: int, n: int, env: VecNormalize | None
) -> Iterator[ReplayBufferSamples | DictReplayBufferSamples]:
    """Yield n batches of a replay buffer.

    Args:
        buffer: Where to sample.
        batch_size: Transitions a batch.
        n: Number of batches.
        env: Normalises what is sampled, if there is one.
    """
    if n == 1:
        yield buffer.sample(batch_size, env=env)
        return
    batch_bytes = 2 * batch_size * bytes_of(buffer.observation_space)
    at_once = max(1, SAMPLE_BYTES // batch_bytes)
    for first in range(0, n, at_once):
        n_here = min(at_once, n - first)
        samples = buffer.sample(batch_size * n_here, env=env)
        for k in range(n_here):
            yield take(samples, slice(k * batch_size, (k + 1) * batch_size))


def bytes_of(space: spaces.Space[Any]) -> int:
    """Size of one observation, at least 1."""
    parts = space.spaces.values() if isinstance(space, spaces.Dict) else [space]
    return max(1, sum(_array_bytes(part) for part in parts))


def _array_bytes(space: spaces.Space[Any]) -> int:
    """Size of one observation that is an array."""
    size = 1
    for length in space.shape or ():
        size *= length
    return size * (space.dtype.itemsize if space.dtype is not None else 1)


def take(
    samples: ReplayBufferSamples | DictReplayBufferSamples, rows: slice
) -> ReplayBufferSamples | DictReplayBufferSamples:
    """Some rows of all tensors of a sample, without copying."""

    def cut(part: Any) -> Any:
        if isinstance(part, dict):
            return {key: tensor[rows] for key, tensor in part.items()}
        return part[rows] if isinstance(part, th.Tensor) else part

    return type(samples)(*map(cut, samples))
