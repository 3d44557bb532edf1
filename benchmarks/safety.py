"""Does the robot hit anything? Random twists and HRA, with full knowledge, the camera, and faults.

Each episode is a row in a CSV file, written when it ends; a run that was stopped goes on where it
was. One thread.

    python benchmarks/safety.py --run hra_camera [--split validation] [--instances 50]
    python benchmarks/safety.py --summary [--split validation]
"""

from __future__ import annotations

import argparse
import csv
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from safety_table import summarise
from smooth_twists import SmoothTwists

import horf_env  # noqa: F401  registers the environment
from horf_env.faults import FAULTS
from horf_env.planners import PLANNERS, Planner
from horf_env.scenes import SCENES
from horf_env.scenes.instances import SPLITS

FOLDER = Path("benchmarks/results/safety")
_TWIST_INSTANCES = 25  # with 1000 steps each and four scenes: 100,000 ticks
_SLACK = 1e-3  # m/s; less is the solver's accuracy


@dataclass(frozen=True)
class Run:
    """What is driven, and in which environment."""

    env: dict[str, Any] = field(default_factory=dict)
    fault: str | None = None
    planner: Callable[[], Planner] = PLANNERS["hra"]
    instances: int | None = None


def _twists() -> dict[str, Run]:
    return {
        f"twists_{limits}_{simulation}": Run(
            {"limits": limits, "simulation": simulation, "perception": "full"},
            planner=SmoothTwists,
            instances=_TWIST_INSTANCES,
        )
        for limits in ("ld60", "paper")
        for simulation in ("kinematic", "dynamic")
    }


RUNS: dict[str, Run] = {
    **_twists(),
    "hra_full": Run({"perception": "full"}),
    "hra_camera": Run(),
    **{f"hra_camera_{fault}": Run(fault=fault) for fault in FAULTS},
}


@dataclass(frozen=True)
class Episode:
    """A row: how an episode ended, how fast the robot was and what the QP had to do."""

    scene: str
    instance: int
    outcome: str
    steps: int
    base_path: float
    ee_path: float
    mean_base_speed: float
    mean_ee_speed: float
    min_distance: float
    contact: str
    solved: int
    fallback: int
    braking: int
    slack_steps: int
    greatest_slack: float
    finite: bool


def drive(env: gym.Env[Any, Any], planner: Planner, scene: str, k: int, split: str) -> Episode:
    """Run one episode; an exception is an outcome of its own."""
    statuses: Counter[str] = Counter()
    slacks: list[float] = []
    finite, done, contact, least = True, False, "", np.inf
    info: dict[str, Any] = {}
    try:
        observation, _ = env.reset(seed=k, options={"instance": k, "split": split})
        planner.reset(env)
        while not done:
            observation, reward, terminated, truncated, info = env.step(planner.act(observation))
            statuses[info["qp_status"]] += 1
            slacks.append(info["qp_slack"])
            least = min(least, info["min_distance"])
            finite &= bool(np.isfinite([reward, *info["velocity"]]).all())
            finite &= all(np.isfinite(part).all() for part in observation.values())
            done = terminated or truncated
        outcome = info["failure"] or "success"
        touching = env.unwrapped.contact  # type: ignore[attr-defined]
        contact = "/".join(touching or ())
    except Exception as error:
        outcome = f"error {type(error).__name__}: {error}"
    seconds = info.get("execution_time", np.nan)
    base, ee = info.get("path_length_base", np.nan), info.get("path_length_ee", np.nan)
    return Episode(
        scene=scene,
        instance=k,
        outcome=outcome,
        steps=len(slacks),
        base_path=base,
        ee_path=ee,
        mean_base_speed=base / seconds,
        mean_ee_speed=ee / seconds,
        min_distance=least,
        contact=contact,
        solved=statuses["solved"],
        fallback=statuses["fallback"],
        braking=statuses["braking"],
        slack_steps=int(np.sum(np.array(slacks) > _SLACK)),
        greatest_slack=max(slacks, default=0.0),
        finite=finite,
    )


def perform(
    run: Run,
    path: Path,
    *,
    split: str,
    instances: int | None,
    scenes: Sequence[str] = tuple(SCENES),
    deadline: float = np.inf,
) -> None:
    """Do what is left of a run and append it to its file.

    Args:
        run: What is driven.
        path: The file.
        split: "validation" or "test".
        instances: Of each scene; all without it.
        scenes: Names of the scenes.
        deadline: When no further episode is begun, by `time.monotonic` [s].
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    done = {(row["scene"], int(row["instance"])) for row in read(path)}
    count = min(n for n in (instances, run.instances, SPLITS[split].size) if n is not None)
    planner = run.planner()
    for scene in scenes:
        left = [k for k in range(count) if (scene, k) not in done]
        if not left or time.monotonic() > deadline:
            continue
        env: gym.Env[Any, Any] = gym.make("horf/Reach-v0", scene=scene, **run.env)
        if run.fault is not None:
            env = FAULTS[run.fault](env)
        for k in left:
            if time.monotonic() <= deadline:
                append(path, drive(env, planner, scene, k, split))
        env.close()


def read(path: Path) -> list[dict[str, str]]:
    """Rows of a file; none if there is no file yet."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def append(path: Path, episode: Episode) -> None:
    """Add a row."""
    new = not path.exists()
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Episode)])
        if new:
            writer.writeheader()
        writer.writerow(asdict(episode))


def main() -> None:
    """Perform a run or summarise."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--run", choices=[*RUNS, "all"])
    parser.add_argument("--split", choices=["validation", "test"], default="validation")
    parser.add_argument("--instances", type=int, help="of each scene; all without it")
    parser.add_argument("--summary", action="store_true", help="print the table, write the JSON")
    arguments = parser.parse_args()
    for name in RUNS if arguments.run == "all" else filter(None, [arguments.run]):
        path = FOLDER / arguments.split / f"{name}.csv"
        perform(RUNS[name], path, split=arguments.split, instances=arguments.instances)
    if arguments.summary:
        rows = {name: read(FOLDER / arguments.split / f"{name}.csv") for name in RUNS}
        summarise(rows, FOLDER / f"{arguments.split}.json")


if __name__ == "__main__":
    main()
