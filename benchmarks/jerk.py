"""Does the switching of the nearest point make the robot chatter? Jerk with 1 and 8 points a body.

HRA with full knowledge on the same validation instances, and with the same starts and goals where
there is no obstacle at all. The commanded velocities of each episode give the jerk (second
difference) and how often accelerations change their sign. Ticks at which the robot stands are left
out: HRA often waits in front of something until the time is over.

    python benchmarks/jerk.py [--instances 10] [--steps 300] [--out benchmarks/results/jerk.json]
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from circumstances import circumstances, write_json

import horf_env  # noqa: F401  registers the environment
from horf_env.control import PRESETS
from horf_env.planners import PLANNERS
from horf_env.scenes.scene import Scene
from horf_env.scenes.source import SceneSource
from horf_env.task import STEP
from horf_env.types import FloatArray

POINTS = {"1 point": 1, "8 points": 8, "no obstacles": 8}
_MOVING = 0.05  # rad/s; the fastest joint of a robot that moves
_QUIET = 1.0  # rad/s^2; a lesser change of sign is no chatter

Episode = tuple[FloatArray, str]


class NoObstacles:
    """Scenes of another source without their obstacles."""

    def __init__(self, source: SceneSource) -> None:
        self._source = source

    def pick(self, rng: np.random.Generator, **options: Any) -> Scene:
        """See `SceneSource`."""
        return replace(self._source.pick(rng, **options), boxes=(), cylinders=(), spheres=())


def velocities(env: gym.Env[Any, Any], instance: int, steps: int) -> Episode:
    """Commanded velocities (T, 9) of an episode, and how it ended ("" if it went on)."""
    planner = PLANNERS["hra"]()
    observation, _ = env.reset(seed=instance, options={"instance": instance, "split": "validation"})
    planner.reset(env)
    info: dict[str, Any] = {}
    commanded, done = [np.zeros(9)], False
    while not done and len(commanded) <= steps:
        observation, _, terminated, truncated, info = env.step(planner.act(observation))
        commanded.append(env.unwrapped.record.command.velocity)  # type: ignore[attr-defined]
        done = terminated or truncated
    return np.array(commanded), info.get("failure", "")


def figures(episodes: list[Episode]) -> dict[str, float]:
    """Jerk of the arm's joints [rad/s^3] and reversals of their accelerations a second."""
    jerks, reversals, ticks = [], 0, 0
    for commanded, _ in episodes:
        arm = commanded[:, 2:]
        acceleration = np.diff(arm, axis=0) / STEP
        moving = np.abs(arm[1:-1]).max(axis=1) > _MOVING
        jerks.append((np.diff(acceleration, axis=0) / STEP)[moving])
        before, after = acceleration[:-1][moving], acceleration[1:][moving]
        turned = (before * after < 0) & (np.minimum(np.abs(before), np.abs(after)) > _QUIET)
        reversals, ticks = reversals + int(turned.sum()), ticks + int(moving.sum())
    jerk = np.abs(np.concatenate(jerks))
    return {
        "moving_ticks": ticks,
        "jerk_rms": float(np.sqrt((jerk**2).mean())),
        "jerk_median": float(np.median(jerk)),
        "jerk_p99": float(np.percentile(jerk, 99)),
        "reversals_per_joint_and_second": reversals / (7 * STEP * ticks),
        "collisions": sum(failure == "collision" for _, failure in episodes),
    }


def measure(scenes: list[str], instances: int, steps: int) -> dict[str, dict[str, float]]:
    """All episodes with each number of witness points, and without obstacles."""
    episodes: dict[str, list[Episode]] = {name: [] for name in POINTS}
    for (name, count), scene in itertools.product(POINTS.items(), scenes):
        preset = replace(PRESETS["default"], witnesses=count)
        env = gym.make("horf/Reach-v0", scene=scene, perception="full", control=preset)
        if name == "no obstacles":
            inner: Any = env.unwrapped
            inner._scenes = NoObstacles(inner._scenes)
        episodes[name] += [velocities(env, k, steps) for k in range(instances)]
        env.close()
    return {name: figures(found) for name, found in episodes.items()}


def main() -> None:
    """Measure, print and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=["room", "forest"])
    parser.add_argument("--instances", type=int, default=10, help="of each scene")
    parser.add_argument("--steps", type=int, default=300, help="of an episode at most")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/jerk.json"))
    arguments = parser.parse_args()
    found = measure(arguments.scenes, arguments.instances, arguments.steps)
    for name, row in found.items():
        print(f"{name}:", *(f"{key} {value:.3g}" for key, value in row.items()), sep="  ")
    options = {name: getattr(arguments, name) for name in ("scenes", "instances", "steps")}
    write_json({**circumstances(), **options, "jerk": found}, arguments.out)


if __name__ == "__main__":
    main()
