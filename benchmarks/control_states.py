"""Control ticks as they occur in episodes, for benchmarks of the control layer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np

import horf_env  # noqa: F401  registers the environment
from horf_env.control import ActionLayer, Command, Sensed
from horf_env.planners import PLANNERS
from horf_env.types import FloatArray

SCENES = ("aisle", "room", "forest", "doorway")
_STEPS_AN_EPISODE = 125
_WANDER = 0.5  # standard deviation of the disturbance of the servo's action
_PERSISTENCE = 0.95  # of the disturbance from step to step


class Listening:
    """An action layer that keeps what it was last told."""

    def __init__(self, layer: ActionLayer) -> None:
        self._layer = layer
        self.action_size = layer.action_size

    def command(self, action: FloatArray, sensed: Sensed) -> Command:
        """Pass on."""
        self.heard = (action, sensed)
        return self._layer.command(action, sensed)


def episode_states(
    count: int, seed: int, *, perception: str = "full"
) -> Iterator[tuple[FloatArray, Sensed]]:
    """Actions and what the robot knew: a disturbed servo on training instances of all scenes.

    Args:
        count: How many, a quarter of them in each scene.
        seed: Of instances and disturbance.
        perception: As for the environment.

    Yields:
        Action, shape (6,), and what the action layer was told.
    """
    rng = np.random.default_rng(seed)
    for scene in SCENES:
        env = gym.make("horf/Reach-v0", scene=scene, perception=perception)
        inner: Any = env.unwrapped
        inner._layer = layer = Listening(inner._layer)
        for k in range(-(-count // (len(SCENES) * _STEPS_AN_EPISODE))):
            yield from _episode(env, layer, rng, seed=seed + k)
        env.close()


def _episode(
    env: gym.Env, layer: Listening, rng: np.random.Generator, *, seed: int
) -> Iterator[tuple[FloatArray, Sensed]]:
    planner = PLANNERS["hra"]()
    observation, _ = env.reset(seed=seed)
    planner.reset(env)
    wander = np.zeros(6)
    for _ in range(_STEPS_AN_EPISODE):
        fresh = np.sqrt(1.0 - _PERSISTENCE**2) * rng.normal(0.0, _WANDER, 6)
        wander = _PERSISTENCE * wander + fresh
        action = np.clip(planner.act(observation) + wander, -1.0, 1.0)
        observation, _, terminated, truncated, _ = env.step(action)
        yield layer.heard
        if terminated or truncated:
            observation, _ = env.reset()
            planner.reset(env)
