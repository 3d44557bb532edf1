"""What one run of a study is, and the name under which its record is kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Task:
    """Where an algorithm learns, for how long, and how often it is looked at.

    Attributes:
        name: Short name, for files and tables.
        env_id: Gymnasium's name of the environment.
        steps: Environment steps of a run.
        evaluate_every: Environment steps between two evaluations.
        episodes: Episodes of one evaluation, without exploration noise.
        bias_steps: Time limit of the episodes on which the bias of Q is measured: an episode tells
            the discounted return of a step only if it goes on for long after that step.
    """

    name: str
    env_id: str
    steps: int
    evaluate_every: int
    episodes: int
    bias_steps: int


@dataclass(frozen=True)
class Run:
    """One run; it is a function of these values alone.

    Attributes:
        task: Where it learns.
        algorithm: A key of `hyperparameters.ALGORITHMS`.
        seed: Of everything random.
        variant: What differs from the task's hyperparameters, for files and tables; may be empty.
        arguments: Arguments of the algorithm in place of the task's hyperparameters.
    """

    task: Task
    algorithm: str
    seed: int
    variant: str = ""
    arguments: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the run's file, without its suffix."""
        parts = (self.task.name, self.algorithm, self.variant, f"seed{self.seed}")
        return "-".join(part for part in parts if part)
