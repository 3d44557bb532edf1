"""Clouds and states from real episodes, for the benchmarks of the distance queries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import gymnasium as gym
import numpy as np

import horf_env  # noqa: F401  registers the environment
from horf_env.planners import PLANNERS
from horf_env.planners.oracle import KnownEnv
from horf_env.robot import RobotState
from horf_env.types import FloatArray

SCENES = ("aisle", "room", "forest", "doorway")
PERCEPTIONS = ("camera", "full")
_EVERY = 15  # steps between two samples of an episode


@dataclass(frozen=True)
class Sample:
    """What the action layer saw at one tick.

    Attributes:
        perception: "camera" or "full".
        state: State of the robot.
        velocity: Shape (9,), m/s and rad/s.
        points: Shape (N, 3), m.
    """

    perception: str
    state: RobotState
    velocity: FloatArray
    points: FloatArray


def collect(n_points: int, steps: int, seed: int) -> list[Sample]:
    """Ticks of HRA on validation instance 0 of each scene, with clouds of the same size.

    Larger clouds are thinned at random, smaller ones filled up by repeating points.
    """
    rng, samples = np.random.default_rng(seed), []
    for scene in SCENES:
        for perception in PERCEPTIONS:
            samples.extend(_episode(scene, perception, steps, n_points, rng))
    return samples


def _episode(
    scene: str, perception: str, steps: int, n_points: int, rng: np.random.Generator
) -> list[Sample]:
    env = gym.make("horf/Reach-v0", scene=scene, perception=perception, disable_env_checker=True)
    observation, _ = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    inner = cast(KnownEnv, env.unwrapped)
    planner, samples = PLANNERS["hra"](), []
    planner.reset(env)
    for k in range(1, steps + 1):
        observation, _, terminated, truncated, info = env.step(planner.act(observation))
        record = inner.record
        if k % _EVERY == 0 and len(record.points):
            n = len(record.points)
            chosen = rng.choice(n, n_points, replace=n < n_points)
            points = np.ascontiguousarray(record.points[np.sort(chosen)])
            samples.append(Sample(perception, record.state, info["velocity"], points))
        if terminated or truncated:
            break
    env.close()
    return samples
