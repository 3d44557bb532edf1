"""What every method of the comparison has: it looks at an observation and acts."""

from __future__ import annotations

from typing import Protocol

import gymnasium as gym
import numpy as np

from horf_env.types import FloatArray


class Planner(Protocol):
    """Who decides the command.

    Attributes:
        action_layer: The action layer that the method's actions are meant for.
    """

    action_layer: str

    def reset(self, env: gym.Env[dict[str, np.ndarray], FloatArray]) -> None:
        """Forget the last episode; called after the environment's reset."""

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """Action in [-1, 1]."""
