"""Actions that correct those of a planner where it gets no further, instead of standing alone.

Not in the paper, whose policy has to find the whole way by itself.
"""

from __future__ import annotations

from collections import deque
from typing import Any, Final, cast

import gymnasium as gym
import numpy as np
from gymnasium import spaces

from horf_env.errors import UnknownNameError
from horf_env.planners import HraPlanner, MappedPlanner, Planner
from horf_env.planners.oracle import KnownEnv
from horf_env.robot.vectors import norm
from horf_env.types import FloatArray

RESIDUAL_PLANNERS: Final[dict[str, type[Planner]]] = {"hra": HraPlanner, "mapped": MappedPlanner}
"""Planners that know what a policy may know; the oracle knows more."""

ADVICE: Final = "advice"
"""Part of the observation: what the planner would do."""

SHARE: Final = 0.5
"""Of the range of actions that a correction covers."""

# A planner gets no further if its gripper is so near to where it was so many steps before, and its
# deviation (m and rad together) has not become less by so much. Policies that corrected it
# everywhere lost goals that it reaches alone, see docs/results.md.
_HELD, _HELD_STEPS, _PROGRESS = 0.3, 60, 0.1  # m, steps, m and rad

# Distance of the gripper from the goal [m] from which on corrections get less: the planner's servo
# then arrives, whatever the corrections are.
_FADE = 2.0

EFFORT: Final = 0.1
"""What a correction costs: so much for the square of each of its six parts. Doing nothing is what
a policy should do that knows nothing."""

HOLD: Final = 10
"""Steps that a correction lasts at least. In half a second it changes something."""


class Residual:
    """A planner whose actions are corrected where it gets no further."""

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

    def reset(self, env: gym.Env[Any, Any]) -> None:
        """Forget the last episode; called after the environment's reset."""
        self._env = cast(KnownEnv, env.unwrapped)
        self._planner.reset(env)
        self._past = deque[tuple[FloatArray, float]](maxlen=_HELD_STEPS + 1)
        self.correct(np.zeros(6))

    def advised(self, observation: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The observation with the planner's action beside it; called once in each step."""
        deviation, place = observation["deviation"], self._env.record.state.T_world_ee[:3, 3]
        self._past.append((place, norm(deviation[:3]) + norm(deviation[3:])))
        self._advice = self._planner.act(observation)
        fading = min(1.0, norm(deviation[:3]) / _FADE)
        self._share = SHARE * fading if self._held else 0.0
        return {**observation, ADVICE: self._advice.astype(np.float32)}

    @property
    def due(self) -> bool:
        """Whether the planner gets no further, and the last correction has lasted long enough."""
        return self._held and self._age >= HOLD

    @property
    def _held(self) -> bool:
        if len(self._past) <= _HELD_STEPS:
            return False
        (before, more), (now, less) = self._past[0], self._past[-1]
        return norm(now - before) < _HELD and more - less < _PROGRESS

    def correct(self, correction: FloatArray) -> None:
        """Replace the correction, shape (6,), in [-1, 1]."""
        self._correction, self._age = correction, 0

    def action(self) -> FloatArray:
        """The planner's last action, corrected where it gets no further, shape (6,)."""
        self._age += 1
        return np.clip(self._advice + self._share * self._correction, -1.0, 1.0)


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
        """Correct what the planner wants to do, up to where the next correction is due.

        That is after ten steps or later, where the planner gets no further the next time, or never.
        The first correction of an episode does nothing. The reward is the sum over these steps,
        less what the correction costs; to a discount they are one step.
        """
        total = -EFFORT * float(np.sum(np.square(np.clip(action, -1.0, 1.0))))
        self._residual.correct(action)
        while True:
            observation, reward, terminated, truncated, info = self.env.step(
                self._residual.action()
            )
            observation, total = self._residual.advised(observation), total + float(reward)
            if terminated or truncated or self._residual.due:
                return observation, total, terminated, truncated, info
