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
from horf_env.robot.vectors import norm
from horf_env.types import FloatArray

RESIDUAL_PLANNERS: Final[dict[str, type[Planner]]] = {"hra": HraPlanner, "mapped": MappedPlanner}
"""Planners that know what a policy may know; the oracle knows more."""

ADVICE: Final = "advice"
"""Part of the observation: what the planner would do."""

SHARE: Final = 0.125
"""Of the range of actions that a correction covers. Random corrections of 0.4, ten steps each, left
`mapped` 4 of 16 goals on training instances, those of 0.2 left 7; alone it reached 14 of 24. A
policy with 0.25 reached 10 test goals less than `mapped`, one with 0.125 7 less."""

_FADE = 2.0
"""Distance of the gripper from the goal [m] from which on corrections get less: the planner's servo
then arrives, whatever the corrections are. The arm unfolds 1.6 m before the goal; with 0.5 m two
policies reached 36 of 40 validation goals, with this one reached 38."""

EFFORT: Final = 0.1
"""What a correction costs: so much for the square of each of its six parts. Without it policies
lost goals that the planner alone reaches."""

HOLD: Final = 10
"""Steps that a correction lasts. In half a second it changes something, and an episode is 100
decisions instead of 1000."""


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
        self._advice, self._share = np.zeros(6), 0.0

    def reset(self, env: gym.Env[Any, Any]) -> None:
        """Forget the last episode; called after the environment's reset."""
        self._planner.reset(env)

    def advised(self, observation: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The observation with the planner's action beside it; called once in each step."""
        self._advice = self._planner.act(observation)
        self._share = SHARE * min(1.0, norm(observation["deviation"][:3]) / _FADE)
        return {**observation, ADVICE: self._advice.astype(np.float32)}

    def action(self, correction: FloatArray) -> FloatArray:
        """The planner's last action and a correction in [-1, 1] together, shape (6,)."""
        return np.clip(self._advice + self._share * correction, -1.0, 1.0)


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
        """Correct what the planner wants to do, for ten steps or up to the end of the episode.

        The reward is the sum over these steps, less what the correction costs.
        """
        total = -EFFORT * float(np.sum(np.square(np.clip(action, -1.0, 1.0))))
        for _ in range(HOLD):
            observation, reward, terminated, truncated, info = self.env.step(
                self._residual.action(action)
            )
            observation, total = self._residual.advised(observation), total + float(reward)
            if terminated or truncated:
                break
        return observation, total, terminated, truncated, info
