"""One episode of one method, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from horf_env.env import HorfReachEnv
from horf_env.planners import Planner

from .environments import Env, instance_options, reach_env, reference_length
from .meter import Measurements, Meter

Observer = Callable[[HorfReachEnv], None]
"""Called after the reset and after each step; looks at the environment's record."""


@dataclass(frozen=True)
class Trial:
    """Result of an episode.

    Attributes:
        method: Who decided.
        scene: Family, or path of the scene file.
        instance: Number of the instance.
        seed: Seed of the episode.
        success: Whether the goal was reached without contact.
        failure: "", "collision", "stuck" (the time was over, the end effector stood still) or
            "timeout".
        steps: Number of steps.
        episode_return: Sum of rewards.
        execution_time: Simulated time [s].
        planning_time: Wall time of planning [s]; see `meter`.
        total_time: Sum of both [s], the paper's total runtime.
        planning_p50: Median wall time of planning a tick [ms].
        planning_p99: 99th percentile of the same [ms].
        path_length_base: Way of the base [m] (TL_MM of the paper's Table 1).
        path_length_ee: Way of the end effector [m] (TL_EE).
        reference_length: Way of the base in the path that proved the instance feasible [m].
        spl: Success weighted by path length, of the base; None, as is the last, for a scene file.
        mean_ee_speed: Way of the end effector by execution time [m/s] (AV).
        min_distance: Least clearance; the simulation looks 0.1 m far [m].
        jerk_ee: RMS jerk of the end effector [m/s^3].
        unsolved: Ticks in which the QP was not solved and the robot braked.
    """

    method: str
    scene: str
    instance: int
    seed: int
    success: bool
    failure: str
    steps: int
    episode_return: float
    execution_time: float
    planning_time: float
    total_time: float
    planning_p50: float
    planning_p99: float
    path_length_base: float
    path_length_ee: float
    reference_length: float | None
    spl: float | None
    mean_ee_speed: float
    min_distance: float
    jerk_ee: float
    unsolved: int

    @property
    def outcome(self) -> str:
        """How it ended: "success" or the failure."""
        return self.failure or "success"


def run_episode(
    env: Env,
    planner: Planner,
    *,
    method: str,
    scene: str,
    instance: int,
    seed: int | None = None,
    split: str = "test",
    observers: Sequence[Observer] = (),
) -> Trial:
    """Drive until the episode ends.

    Args:
        env: Where.
        planner: Who decides.
        method: Its name in the result.
        scene: Scene that the environment was made for.
        instance: Number of the instance.
        seed: Of the episode's noise; by default the number of the instance, so that all methods
            meet the same noise.
        split: Set of the instance: "test" or "validation".
        observers: Called after the reset and after each step.
    """
    seed = instance if seed is None else seed
    observation, info = env.reset(seed=seed, options=instance_options(scene, split, instance))
    planner.reset(env)
    meter = Meter(reach_env(env))
    _tell(observers, env)
    total, steps, done = 0.0, 0, False
    while not done:
        observation, reward, terminated, truncated, info = env.step(
            meter.decide(planner, observation)
        )
        meter.look()
        _tell(observers, env)
        total, steps, done = total + float(reward), steps + 1, terminated or truncated
    return Trial(
        method=method,
        scene=scene,
        instance=instance,
        seed=seed,
        steps=steps,
        episode_return=total,
        **_outcome(info, meter.read(), reference_length(scene, split, instance)),
    )


def _tell(observers: Sequence[Observer], env: Env) -> None:
    for observer in observers:
        observer(reach_env(env))


def _outcome(
    info: dict[str, Any], measured: Measurements, reference: float | None
) -> dict[str, Any]:
    """What the environment told at the end, what was measured, and what follows from both."""
    success, base = bool(info["is_success"]), info["path_length_base"]
    stuck = info["failure"] == "timeout" and measured.stands_still
    return {
        "success": success,
        "failure": "stuck" if stuck else info["failure"],
        "execution_time": info["execution_time"],
        "planning_time": measured.planning_time,
        "total_time": info["execution_time"] + measured.planning_time,
        "planning_p50": measured.planning_p50,
        "planning_p99": measured.planning_p99,
        "path_length_base": base,
        "path_length_ee": info["path_length_ee"],
        "reference_length": reference,
        "spl": None if reference is None else success * reference / max(base, reference),
        "mean_ee_speed": info["path_length_ee"] / info["execution_time"],
        "min_distance": measured.min_distance,
        "jerk_ee": measured.jerk_ee,
        "unsolved": measured.unsolved,
    }
