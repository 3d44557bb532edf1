"""One episode of one method, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from horf_env.env import HorfReachEnv
from horf_env.planners import Planner

from .environments import Env, instance_options, reach_env

Observer = Callable[[HorfReachEnv], None]
"""Called after the reset and after each step; looks at the environment's record."""


@dataclass(frozen=True)
class Trial:
    """Result of an episode.

    Attributes:
        method: Who decided.
        scene: Family, or path of the scene file.
        instance: Number of the instance, and seed of the episode.
        success: Whether the goal was reached without contact.
        failure: "", "collision" or "timeout".
        steps: Number of steps.
        episode_return: Sum of rewards.
        execution_time: Simulated time [s].
        path_length_base: Way of the base [m] (TL_MM of the paper's Table 1).
        path_length_ee: Way of the end effector [m] (TL_EE).
        mean_ee_speed: Way of the end effector by execution time [m/s] (AV).
        min_distance: Least clearance; the simulation looks 0.1 m far [m].
    """

    method: str
    scene: str
    instance: int
    success: bool
    failure: str
    steps: int
    episode_return: float
    execution_time: float
    path_length_base: float
    path_length_ee: float
    mean_ee_speed: float
    min_distance: float

    @property
    def outcome(self) -> str:
        """How it ended: "success", "collision" or "timeout"."""
        return self.failure or "success"


def run_episode(
    env: Env,
    planner: Planner,
    *,
    method: str,
    scene: str,
    instance: int,
    split: str = "test",
    observers: Sequence[Observer] = (),
) -> Trial:
    """Drive until the episode ends.

    The seed of the episode is the number of the instance, so that all methods meet the same noise.

    Args:
        env: Where.
        planner: Who decides.
        method: Its name in the result.
        scene: Scene that the environment was made for.
        instance: Number of the instance.
        split: Set of the instance: "test" or "validation".
        observers: Called after the reset and after each step.
    """
    options = instance_options(scene, split, instance)
    observation, info = env.reset(seed=instance, options=options)
    planner.reset(env)
    _tell(observers, env)
    least, total, steps, done = float(info["min_distance"]), 0.0, 0, False
    while not done:
        observation, reward, terminated, truncated, info = env.step(planner.act(observation))
        _tell(observers, env)
        least, total, steps = min(least, info["min_distance"]), total + float(reward), steps + 1
        done = terminated or truncated
    return _trial(method, scene, instance, info, steps=steps, total=total, least=least)


def _tell(observers: Sequence[Observer], env: Env) -> None:
    for observer in observers:
        observer(reach_env(env))


def _trial(
    method: str,
    scene: str,
    instance: int,
    info: dict[str, Any],
    *,
    steps: int,
    total: float,
    least: float,
) -> Trial:
    return Trial(
        method=method,
        scene=scene,
        instance=instance,
        success=bool(info["is_success"]),
        failure=info["failure"],
        steps=steps,
        episode_return=total,
        execution_time=info["execution_time"],
        path_length_base=info["path_length_base"],
        path_length_ee=info["path_length_ee"],
        mean_ee_speed=info["path_length_ee"] / info["execution_time"],
        min_distance=least,
    )
