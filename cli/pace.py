"""How fast a training run goes."""

from __future__ import annotations

import time

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm

from .progress import Snapshot
from .run_state import Times

_SECONDS = 0.5  # between two snapshots


class Pace:
    """Measures one session of a run.

    Args:
        steps: Environment steps in the end.
        first: Environment steps before this session.
    """

    def __init__(self, steps: int, first: int) -> None:
        self._steps, self._first = steps, first
        self._begin = self._last = time.perf_counter()

    def is_due(self) -> bool:
        """Whether the last snapshot is old."""
        return time.perf_counter() - self._last > _SECONDS

    def snapshot(self, model: BaseAlgorithm, times: Times) -> Snapshot:
        """How it stands.

        Args:
            model: The model.
            times: Of the whole run until now.
        """
        self._last, step = time.perf_counter(), model.num_timesteps
        rate = (step - self._first) / (self._last - self._begin)
        episodes, successes = model.ep_info_buffer, model.ep_success_buffer
        return Snapshot(
            step=step,
            steps=self._steps,
            rate=rate,
            eta=(self._steps - step) / rate,
            mean_return=float(np.mean([e["r"] for e in episodes])) if episodes else None,
            success=float(np.mean(successes)) if successes else None,
            environment=times.environment / times.total,
            update=times.update / times.total,
            evaluation=times.evaluation / times.total,
        )
