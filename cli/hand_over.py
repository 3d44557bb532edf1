"""Training episodes that begin nearer to the goal: the oracle drives, then hands over.

A curriculum over distance, not in the paper. Driven there, the robot is in a state and has a map as
a policy would meet them; put there, it would know nothing of what is around it.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from horf_env.planners import OraclePlanner

from .environments import Env, reach_env

_NEAREST = 0.3  # m; the end effector is at least so far from the goal when it is handed over
_MOST_STEPS = 500  # of the oracle; where it is stuck it hands over


class HandOver(gym.Wrapper[Any, Any, Any, Any]):
    """In a share of the episodes the oracle takes the first steps, up to a random distance.

    Args:
        env: The environment.
        share: Of the episodes, in [0, 1].
    """

    def __init__(self, env: Env, share: float) -> None:
        super().__init__(env)
        self._share, self._oracle = share, OraclePlanner()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; anew if the oracle hits something."""
        observation, info = self.env.reset(seed=seed, options=options)
        rng = self.env.unwrapped.np_random
        if rng.random() >= self._share:
            return observation, info
        self._oracle.reset(self.env)
        distance = rng.uniform(_NEAREST, max(self._distance(), _NEAREST))
        for _ in range(_MOST_STEPS):
            if self._distance() <= distance:
                break
            action = self._oracle.act(observation)
            observation, _, terminated, _, info = self.env.step(action)
            if terminated:
                return self.reset(options=options)
        return observation, info

    def _distance(self) -> float:
        """Of the end effector from the goal [m]."""
        env = reach_env(self.env)
        offset = env.T_world_goal[:3, 3] - env.record.state.T_world_ee[:3, 3]
        return float(np.linalg.norm(offset))
