"""Random twists that change smoothly, up to full speed: they lead everywhere and spare nothing."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from horf_env.types import FloatArray

_PERSISTENCE = 0.95  # of a twist from step to step: it is forgotten within about a second
_SPREAD = 1.0  # standard deviation; a third of the components is at full speed


class SmoothTwists:
    """A planner without a goal: an autoregressive random action, clipped to full speed."""

    action_layer = "sdf_qp"

    def reset(self, env: gym.Env[dict[str, np.ndarray], FloatArray]) -> None:
        """Begin anew with the environment's generator, so that equal seeds give equal twists."""
        self._rng = env.unwrapped.np_random
        self._action = np.zeros(6)

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """The next action, whatever is observed."""
        fresh = self._rng.normal(0.0, _SPREAD * np.sqrt(1.0 - _PERSISTENCE**2), 6)
        self._action = _PERSISTENCE * self._action + fresh
        return np.clip(self._action, -1.0, 1.0)
