"""Which camera pose shows the arm's way before the arm is there?

HRA drives with full knowledge on validation instances; the same motions are then looked at through
cameras at other places. Counted is the share of the voxels that the arm enters, which a ray had
passed before.

    python benchmarks/camera_pose.py [--instances 3] [--out benchmarks/results/camera_pose.json]
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path

import gymnasium as gym
import numpy as np
from circumstances import circumstances, write_json

import horf_env  # noqa: F401  registers the environment
from horf_env.perception import CameraModel, MapSettings
from horf_env.planners import PLANNERS
from horf_env.robot import MobileManipulator, RobotState
from horf_env.scenes import SCENES
from horf_env.scenes.scene import Scene
from horf_env.sdf import RobotSdf
from horf_env.sensing import Senses

Ways = list[tuple[Scene, list[RobotState]]]

_STEPS = 150  # HRA stands still afterwards
_HEIGHTS = (0.2, 0.33, 0.4)  # m; on the front of the LD-60, whose top is at 0.38 m
_PITCHES = (0, 10, 15, 20, 25, 30, 35)  # degrees up


def motions(instances: int) -> Ways:
    """What HRA does with full knowledge."""
    found = []
    for name, k in itertools.product(SCENES, range(instances)):
        env = gym.make("horf/Reach-v0", scene=name, perception="full")
        planner = PLANNERS["hra"]()
        observation, _ = env.reset(seed=k, options={"instance": k, "split": "validation"})
        planner.reset(env)
        inner = env.unwrapped
        states, done = [inner.record.state], False  # type: ignore[attr-defined]
        while not done and len(states) < _STEPS:
            observation, _, terminated, truncated, _ = env.step(planner.act(observation))
            states.append(inner.record.state)  # type: ignore[attr-defined]
            done = terminated or truncated
        found.append((inner.scene, states))  # type: ignore[attr-defined]
        env.close()
    return found


def seen_share(model: CameraModel, sdf: RobotSdf, ways: Ways) -> float:
    """Share of the voxels newly entered by the arm that had been seen before."""
    senses = Senses(sdf, model, perception="camera", memory=MapSettings(), depth_noise=False)
    rng, entered, seen, voxel = np.random.default_rng(0), 0, 0, MapSettings().voxel
    for scene, states in ways:
        senses.reset(scene, states[0], rng, lambda image: image)
        visited = _voxels(senses.arm_points(states[0]), voxel)
        for step, state in enumerate(states[1:], start=1):
            points = senses.arm_points(state)
            new = [p for p, v in zip(points, _keys(points, voxel), strict=True) if v not in visited]
            if new:
                entered += len(new)
                seen += int(senses.memory.seen(np.array(new)).sum())
            visited |= _voxels(points, voxel)
            senses.update(state, rng, 0.05 * step, lambda image: image)
    return seen / entered


def _keys(points: np.ndarray, voxel: float) -> list[tuple[int, ...]]:
    return [tuple(key) for key in np.floor(points / voxel).astype(int).tolist()]


def _voxels(points: np.ndarray, voxel: float) -> set[tuple[int, ...]]:
    return set(_keys(points, voxel))


def main() -> None:
    """Measure and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--instances", type=int, default=3, help="of each scene")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/camera_pose.json"))
    arguments = parser.parse_args()
    sdf, ways = RobotSdf.load(MobileManipulator.load()), motions(arguments.instances)
    shares = {}
    for height, pitch in itertools.product(_HEIGHTS, _PITCHES):
        model = CameraModel(position=(0.365, 0.0, height), pitch_up=float(np.deg2rad(pitch)))
        shares[f"{height} m, {pitch} deg"] = share = seen_share(model, sdf, ways)
        print(f"{height:.2f} m {pitch:3d} deg: {share:.3f}", flush=True)
    result = {
        **circumstances(),
        "instances_a_scene": arguments.instances,
        "steps": _STEPS,
        "seen_share": shares,
    }
    write_json(result, arguments.out)


if __name__ == "__main__":
    main()
