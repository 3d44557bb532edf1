"""Frames of stacked observations, each stored once, with the stacks as lists of places."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Final

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from sb3_bayes_dsac.errors import FrameStackError

# Spare places over one frame a transition, as a share. An episode needs one frame more than it has
# transitions, so this is enough for episodes of 16 steps and more; with shorter ones it grows.
SPARE: Final = 1 / 16

Stacks = NDArray[Any]


def same(a: Stacks, b: Stacks) -> bool:
    """Whether two arrays of one type and shape have the same bits (NaN included)."""
    return a.tobytes() == b.tobytes()


class FrameStore:
    """Observations of one key for a ring of transitions, (k, ...) stacks of k frames.

    A transition is k + 1 frames: those of its observation and the newest of its successor. A frame
    has a place in one array; a transition lists the places of its frames, so that transitions share
    frames. Places are free again when the last transition that lists them is overwritten.

    Args:
        key: The key, for errors.
        space: Space of a stack: first axis time, oldest first.
        buffer_size: Transitions of each environment.
        n_envs: Environments.
    """

    def __init__(self, key: str, space: spaces.Space[Any], buffer_size: int, n_envs: int) -> None:
        assert space.shape is not None
        self._key = key
        self._dtype = space.dtype
        count, *shape = space.shape
        self._places = np.full((buffer_size, n_envs, count + 1), -1, np.int32)
        capacity = int((1 + SPARE) * buffer_size * n_envs) + (count + 1) * n_envs
        self._frames = np.zeros((capacity, *shape), space.dtype)
        # Taken from the end: low places first, so that untouched memory stays untouched.
        self._free = list(range(capacity))[::-1]
        # Each environment's last successor and its places.
        self._last = np.zeros((n_envs, count, *shape), space.dtype)
        self._last_places = np.full((n_envs, count), -1, np.int32)

    @property
    def nbytes(self) -> int:
        """Size in bytes of what grows with the number of transitions."""
        return self._frames.nbytes + self._places.nbytes

    @property
    def stored(self) -> int:
        """Number of frames that are stored now."""
        return len(self._frames) - len(self._free)

    def check(self, obs: Stacks, next_obs: Stacks) -> None:
        """Refuse observations that are no shifted stacks.

        Args:
            obs: One stack an environment, shape (n_envs, k, ...).
            next_obs: Their successors, of the same shape.

        Raises:
            FrameStackError: A successor is not its predecessor without the oldest frame and with a
                new one behind.
        """
        for env in range(self._places.shape[1]):
            if not same(self._cast(next_obs[env])[:-1], self._cast(obs[env])[1:]):
                raise FrameStackError(self._key, env)

    def put(self, row: int, obs: Stacks, next_obs: Stacks) -> None:
        """Store one transition of each environment in place of those in a row.

        Args:
            row: Row of the ring.
            obs: Checked stacks, shape (n_envs, k, ...).
            next_obs: Their successors, of the same shape.
        """
        for env in range(self._places.shape[1]):
            stack, newest = self._cast(obs[env]), self._cast(next_obs[env])[-1]
            continues = self._last_places[env, 0] >= 0 and same(stack, self._last[env])
            places = self._last_places[env].tolist() if continues else self._store_stack(stack)
            places.append(self._store(newest))
            overwritten = self._places[row, env].tolist()
            self._places[row, env] = places
            self._release(overwritten, row, env)
            self._last[env] = next_obs[env]
            self._last_places[env] = places[1:]

    def windows(self, rows: NDArray[np.int64], envs: NDArray[np.int64]) -> Stacks:
        """Frames of some transitions, shape (B, k + 1, ...): obs is [:, :-1], next [:, 1:]."""
        return self._frames.take(self._places[rows, envs], axis=0)

    def _cast(self, stack: Stacks) -> Stacks:
        """A stack in the type in which it is stored."""
        return np.asarray(stack, self._dtype)

    def _store_stack(self, stack: Stacks) -> list[int]:
        """Store the first stack of an episode; frames that repeat get one place."""
        places = [self._store(stack[0])]
        for before, frame in pairwise(stack):
            places.append(places[-1] if same(before, frame) else self._store(frame))
        return places

    def _store(self, frame: Stacks) -> int:
        """Store a frame and say where."""
        if not self._free:
            self._grow()
        place = self._free.pop()
        self._frames[place] = frame
        return place

    def _release(self, overwritten: list[int], row: int, env: int) -> None:
        """Free the places that no transition lists any more.

        A frame is in neighbouring transitions, so one that the overwritten transition listed and
        the next oldest does not list is in none.
        """
        following = (row + 1) % len(self._places)
        gone = set(overwritten) - set(self._places[following, env].tolist()) - {-1}
        self._free.extend(gone)

    def _grow(self) -> None:
        """Add places: episodes are shorter than `SPARE` provides for."""
        old = len(self._frames)
        extra = int(SPARE * old) + 1
        spare = np.zeros((extra, *self._frames.shape[1:]), self._dtype)
        self._frames = np.concatenate([self._frames, spare])
        self._free = list(range(old, old + extra))[::-1]
