"""Cost of one environment step, named against a frame of PyBullet's own renderer.

Both run in one process, one thread, alternating, on the same scene; medians and their ratio count,
not the absolute times. Also: the first start with empty caches, and the memory of the process.

    python benchmarks/step_speed.py [--steps 300] [--out benchmarks/results/step_speed.json]
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from circumstances import circumstances, write_json

import horf_env  # noqa: F401  registers the environment
from horf_env.planners import PLANNERS

SCENES = ("aisle", "room", "forest", "doorway")
_FIRST_START = (
    "import numpy as np; from horf_env.robot import MobileManipulator, ARM_READY;"
    "from horf_env.sdf import RobotSdf; r = MobileManipulator.load(); sdf = RobotSdf.load(r);"
    "sdf.query(np.ones((10, 3)), np.concatenate([np.zeros(3), ARM_READY]))"
)


def measure(scene: str, steps: int) -> dict[str, float]:
    """Median milliseconds of a step and of a TinyRenderer frame, alternating."""
    env = gym.make("horf/Reach-v0", scene=scene, render_mode="rgb_array", disable_env_checker=True)
    planner = PLANNERS["hra"]()
    observation, _ = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    inner: Any = env.unwrapped
    world = inner._world
    world.render_rgb(width=64, height=48)
    step_times, frame_times = [], []
    for k in range(steps):
        action = planner.act(observation)
        begin = time.perf_counter()
        observation, _, terminated, truncated, _ = env.step(action)
        step_times.append(time.perf_counter() - begin)
        if k % 5 == 0:
            begin = time.perf_counter()
            world.render_rgb(width=64, height=48)
            frame_times.append(time.perf_counter() - begin)
        if terminated or truncated:
            observation, _ = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    env.close()
    step, frame = 1e3 * np.median(step_times), 1e3 * np.median(frame_times)
    return {"step_ms": float(step), "tiny_renderer_ms": float(frame), "ratio": float(step / frame)}


def first_start() -> float:
    """Seconds to build the fields and compile the kernels with empty caches."""
    with tempfile.TemporaryDirectory() as empty:
        caches = {"XDG_CACHE_HOME": empty, "NUMBA_CACHE_DIR": empty}
        begin = time.perf_counter()
        subprocess.run([sys.executable, "-c", _FIRST_START], check=True, env=os.environ | caches)
        return time.perf_counter() - begin


def main() -> None:
    """Measure all scenes and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/step_speed.json"))
    arguments = parser.parse_args()
    result = {
        **circumstances(),
        "threads": os.environ.get("OMP_NUM_THREADS", "all"),
        "first_start_s": first_start(),
        "scenes": {scene: measure(scene, arguments.steps) for scene in SCENES},
        "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
    write_json(result, arguments.out)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
