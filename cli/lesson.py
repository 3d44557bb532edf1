"""Training episodes in which a teacher and the learner drive in turns.

The teacher is the planner `mapped`, not the oracle: where the true way is not the one that the own
map suggests, nothing that the learner sees tells the oracle's action; it would learn scenes by
heart.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from horf_env.planners import MappedPlanner
from horf_env.robot import ARM_READY
from horf_env.types import FloatArray
from sb3_bayes_dsac.common.taught_buffer import TAKEN_ACTION, TEACHER_ACTION

from .environments import Env

_TURN = (20, 80)  # steps that one of them drives, at random in between
# Some turns of the teacher have this noise on their actions (standard deviation), so that it also
# shows what follows after an error.
_NOISE, _NOISY_SHARE = 0.2, 0.4


class Lesson(gym.Wrapper[Any, Any, Any, Any]):
    """Tells in `info` what the teacher would do, and what was done.

    The learner's share is drawn anew for each episode, in [0, 1]: without the teacher's turns a
    learner of the first hour does not get to the goal, and without its own it does not meet its
    errors.
    """

    def __init__(self, env: Env) -> None:
        super().__init__(env)
        # The learner's arm goes back to the ready pose, whoever drives.
        self._teacher = MappedPlanner(ARM_READY)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode."""
        self._observation, info = self.env.reset(seed=seed, options=options)
        self._teacher.reset(self.env)
        self._rng = np.random.default_rng(self.env.unwrapped.np_random.integers(2**63))
        self._share, self._left = self._rng.random(), 0
        return self._observation, info

    def step(self, action: FloatArray) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """The learner's action, or the teacher's instead."""
        if not self._left:
            self._change_driver()
        self._left -= 1
        advice = self._advice()
        taken = action
        if self._teacher_drives:
            taken = np.clip(advice + self._noise * self._rng.standard_normal(6), -1.0, 1.0)
        self._observation, *outcome, info = self.env.step(taken.astype(np.float32))
        told = {TEACHER_ACTION: advice, TAKEN_ACTION: taken}
        info |= {key: told[key].astype(np.float32) for key in told}
        reward, terminated, truncated = outcome
        return self._observation, reward, bool(terminated), bool(truncated), info

    def _change_driver(self) -> None:
        self._teacher_drives = self._rng.random() >= self._share
        self._noise = _NOISE * (self._rng.random() < _NOISY_SHARE)
        self._left = int(self._rng.integers(*_TURN))

    def _advice(self) -> FloatArray:
        return (
            self._teacher.act(self._observation) if self._teacher_drives else self._teacher.advise()
        )
