"""Batches for many gradient steps, sampled together where that is cheaper."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Final, TypeAlias

import torch as th
from gymnasium import spaces
from stable_baselines3.common.buffers import BaseBuffer
from stable_baselines3.common.type_aliases import DictReplayBufferSamples, ReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize

Batch: TypeAlias = ReplayBufferSamples | DictReplayBufferSamples

# Bytes of observations that are sampled at once. One call for many batches saves overhead, but
# beyond the second-level cache it only moves memory twice.
SAMPLE_BYTES: Final = 4_000_000


def minibatches(
    buffer: BaseBuffer, batch_size: int, n: int, env: VecNormalize | None
) -> Iterator[Batch]:
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
        samples = buffer.sample(batch_size * min(at_once, n - first), env=env)
        parts = (th.split(tensor, batch_size) for tensor in tensors_of(samples))
        for tensors in zip(*parts, strict=True):
            yield with_tensors(samples, tensors)


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


def tensors_of(samples: Batch) -> list[th.Tensor]:
    """All tensors of a sample."""
    return [tensor for _, tensor in named_tensors(samples)]


def named_tensors(samples: Batch) -> Iterator[tuple[str, th.Tensor]]:
    """All tensors of a sample by name."""
    for name, part in samples._asdict().items():
        if isinstance(part, dict):
            yield from ((f"{name}[{key!r}]", tensor) for key, tensor in part.items())
        elif part is not None:
            yield name, part


def with_tensors(samples: Batch, tensors: Iterable[th.Tensor]) -> Batch:
    """A sample with other tensors, in the order of `tensors_of`."""
    others = iter(tensors)

    def replace(part: Any) -> Any:
        if isinstance(part, dict):
            return {key: next(others) for key in part}
        return None if part is None else next(others)

    return type(samples)(*map(replace, samples))
