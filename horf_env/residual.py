"""Actions that correct those of a planner, instead of standing alone.

Not in the paper, whose policy has to find the whole way by itself.
"""

from __future__ import annotations

from typing import Any, Final

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from horf_env.errors import UnknownNameError
from horf_env.planners import HraPlanner, MappedPlanner, Planner
from horf_env.types import FloatArray

RESIDUAL_PLANNERS: Final[dict[str, type[Planner]]] = {"hra": HraPlanner, "mapped": MappedPlanner}
"""Planners that know what a policy may know; the oracle knows more."""

ADVICE: Final = "advice"
"""Part of the observation: what the planner would do."""

SHARE: Final = 0.4
"""Of the range of actions that a correction covers: enough to stop a base that drives slowly, and
with random corrections the planner `mapped` still reaches most goals that it reaches alone."""


class Residual:
    """A planner whose actions are corrected."""

    def __init__(self, planner: str) -> None:
        """Make the planner.

        Args:
            planner: A key of `RESIDUAL_PLANNERS`.

        Raises:
            UnknownNameError: If it is none.
        """
        if planner not in RESIDUAL_PLANNERS:
            raise UnknownNameError("planner to be corrected", planner, RESIDUAL_PLANNERS)
        self._planner = RESIDUAL_PLANNERS[planner]()
        self._advice = np.zeros(6)

    def reset(self, env: gym.Env[Any, Any]) -> None:
        """Forget the last episode; called after the environment's reset."""
        self._planner.reset(env)

    def advised(self, observation: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The observation with the planner's action beside it; called once a step."""
        self._advice = self._planner.act(observation)
        return {**observation, ADVICE: self._advice.astype(np.float32)}

    def action(self, correction: FloatArray) -> FloatArray:
        """The planner's last action and a correction in [-1, 1] together, shape (6,)."""
        return np.clip(self._advice + SHARE * correction, -1.0, 1.0).astype(np.float32)


class ResidualActions(gym.Wrapper[Any, Any, Any, Any]):
    """`horf/Reach-v0` with corrections of a planner as actions, and `advice` in observations."""

    def __init__(self, env: gym.Env[Any, Any], planner: str) -> None:
        """Wrap an environment whose actions are twists.

        Args:
            env: `horf/Reach-v0`, wrapped or not.
            planner: A key of `RESIDUAL_PLANNERS`.

        Raises:
            UnknownNameError: If there is no such planner.
        """
        super().__init__(env)
        self._residual = Residual(planner)
        parts = dict(env.observation_space.spaces)  # type: ignore[attr-defined]
        parts[ADVICE] = spaces.Box(-1.0, 1.0, (6,), np.float32)
        self.observation_space = spaces.Dict(parts)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._residual.reset(self.env)
        return self._residual.advised(observation), info

    def step(self, action: FloatArray) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Correct what the planner wants to do."""
        observation, reward, *outcome, info = self.env.step(self._residual.action(action))
        terminated, truncated = outcome
        return self._residual.advised(observation), reward, terminated, truncated, info
