"""A replay buffer that also keeps what a teacher would have done."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch as th
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecNormalize

from sb3_bayes_dsac.common.buffers import FrameStackReplayBuffer, Observations
from sb3_bayes_dsac.errors import ArgumentError

TEACHER_ACTION, TAKEN_ACTION = "teacher_action", "taken_action"
"""Keys of `info`: what the teacher would have done, and what was done, shape (action_dim,)."""


class TaughtSamples(NamedTuple):
    """`DictReplayBufferSamples` with the teacher's actions, shape (B, action_dim)."""

    observations: dict[str, th.Tensor]
    actions: th.Tensor
    next_observations: dict[str, th.Tensor]
    dones: th.Tensor
    rewards: th.Tensor
    discounts: th.Tensor | None
    teacher_actions: th.Tensor


class TaughtReplayBuffer(FrameStackReplayBuffer):
    """Reads the teacher's and the taken action from `info`.

    An environment in which a teacher may take over does not always do what the policy wanted.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.teacher_actions = np.zeros_like(self.actions)

    def add(  # type: ignore[override]
        self,
        obs: Observations,
        next_obs: Observations,
        action: NDArray[Any],
        reward: NDArray[Any],
        done: NDArray[Any],
        infos: list[dict[str, Any]],
    ) -> None:
        """Store one transition of each environment; `action` is what the policy wanted.

        Raises:
            ArgumentError: No teacher speaks in `info`.
        """
        if any(TEACHER_ACTION not in info or TAKEN_ACTION not in info for info in infos):
            cure = f"the environment has to give {TEACHER_ACTION!r} and {TAKEN_ACTION!r}"
            raise ArgumentError("infos", sorted(infos[0]), cure)
        row = self.pos
        super().add(obs, next_obs, _stacked(infos, TAKEN_ACTION), reward, done, infos)
        self.teacher_actions[row] = _stacked(infos, TEACHER_ACTION)

    def _samples_at(  # type: ignore[override]
        self, at: tuple[NDArray[np.int64], NDArray[np.int64]], env: VecNormalize | None
    ) -> TaughtSamples:
        teacher_actions = self.to_torch(self.teacher_actions[at])
        return TaughtSamples(*super()._samples_at(at, env), teacher_actions)


def _stacked(infos: list[dict[str, Any]], key: str) -> NDArray[Any]:
    return np.stack([info[key] for info in infos])
