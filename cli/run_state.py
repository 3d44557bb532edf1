"""What a run needs to go on as if it had never stopped, beside its model and replay buffer."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import torch as th
from stable_baselines3.common.base_class import BaseAlgorithm

from .training_envs import EpisodeState


@dataclass(frozen=True)
class Generators:
    """States of the generators of Python, NumPy, torch and the action space."""

    python: Any
    numpy: Any
    torch: th.Tensor
    cuda: list[th.Tensor]
    actions: dict[str, Any]

    @classmethod
    def of(cls, model: BaseAlgorithm) -> Generators:
        """As they are now."""
        return cls(
            python=random.getstate(),
            numpy=np.random.get_state(),
            torch=th.get_rng_state(),
            cuda=th.cuda.get_rng_state_all() if th.cuda.is_available() else [],
            actions=dict(model.action_space.np_random.bit_generator.state),
        )

    def restore(self, model: BaseAlgorithm) -> None:
        """Set them."""
        random.setstate(self.python)
        np.random.set_state(self.numpy)
        th.set_rng_state(self.torch)
        if self.cuda:
            th.cuda.set_rng_state_all(self.cuda)
        model.action_space.np_random.bit_generator.state = self.actions


@dataclass(frozen=True)
class Times:
    """Where the seconds of a run went.

    Attributes:
        total: All.
        environment: Steps of the environments.
        update: Gradient steps.
        evaluation: Evaluation episodes, with their recordings.
        storage: Checkpoints and metrics.
    """

    total: float = 0.0
    environment: float = 0.0
    update: float = 0.0
    evaluation: float = 0.0
    storage: float = 0.0

    def named(self) -> dict[str, float]:
        """Seconds by name."""
        return asdict(self)


@dataclass(frozen=True)
class Standing:
    """What the evaluations of a run have brought.

    Attributes:
        next_evaluation: Step of the next one.
        score: Success rate and return of the best one.
        policy: Its policy, as the content of a file; None before the first.
    """

    next_evaluation: int
    score: tuple[float, float] = (-1.0, -np.inf)
    policy: bytes | None = None

    def after(
        self, score: tuple[float, float], policy: Callable[[], bytes], next_evaluation: int
    ) -> Standing:
        """With one more evaluation, whose policy is asked for only if it is the best."""
        if score > self.score:
            return Standing(next_evaluation, score, policy())
        return replace(self, next_evaluation=next_evaluation)


@dataclass(frozen=True)
class RunState:
    """State of a run at the beginning of a rollout, where nothing is half done.

    Attributes:
        generators: Random numbers to come.
        episodes: Of the training environments.
        pending: Values that the logger has not written yet (its three dictionaries).
        times: Until now.
        standing: Of the evaluations.
        metrics_parts: Parts of metrics that count.
        evaluation_parts: The same of evaluations.
    """

    generators: Generators
    episodes: list[EpisodeState]
    pending: tuple[dict[str, Any], dict[str, int], dict[str, Any]]
    times: Times
    standing: Standing
    metrics_parts: int
    evaluation_parts: int
