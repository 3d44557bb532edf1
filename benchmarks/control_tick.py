"""Time of one tick of perception and control on real episodes, beside rivals, one thread.

HRA drives with the camera on validation instances; after each step the same tick is done again by
the layers below the environment, in parts: an image that is already rendered goes into the local
map, points come out, distances are asked for, the rows of the QP are built and it is solved. The
rivals see the same tick: the paper's full form of the QP through qpsolvers, and the tick of HFBS
with the paper's memory of five frames (40 sampled points against a k-d tree of the cloud).
Processor time of the thread; ratios count more than times.

    OMP_NUM_THREADS=1 python benchmarks/control_tick.py [--steps 250] [--out FILE.json]
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from circumstances import circumstances, write_json
from control_chain import Chain, Listening
from processor_time import T, timed

import horf_env  # noqa: F401  registers the environment
from horf_env.control import PRESETS, ControlTick
from horf_env.control.reference import solve_reference
from horf_env.control.sampled_qp_layer import SampledQpLayer
from horf_env.control.sdf_qp_layer import SdfQpLayer
from horf_env.perception import Image
from horf_env.planners import PLANNERS
from horf_env.scenes import SCENES
from horf_env.types import FloatArray

TICK, QP = "whole tick", "QP: rows and solve"
_SHARES = ("map update", "points from the map", "EE Jacobian and distance queries", QP)
_SOLVERS = ("daqp", "piqp")
_WARM_UP = 5  # ticks of an episode that are not counted: what is loaded and touched first
_BARS = {TICK: {"median_ms": 0.6, "p99_ms": 2.0}, QP: {"median_ms": 0.06}}


class Clock:
    """Milliseconds of processor time by name, one number a tick."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = defaultdict(list)

    def timed(self, name: str, function: Callable[[], T]) -> T:
        """Call and note the time."""
        result, microseconds = timed(function)
        self.times[name].append(1e-3 * microseconds)
        return result

    def add_up(self, total: str, shares: tuple[str, ...]) -> None:
        """Note the sum of what was noted last."""
        self.times[total].append(sum(self.times[name][-1] for name in shares))


def one_tick(
    clock: Clock,
    own: Chain,
    rival: Chain,
    image: Image,
    known: tuple[FloatArray, FloatArray, float],
) -> None:
    """Do a tick with our own chain, part by part, and then with the rivals."""
    action, velocity, error = known
    clock.timed(_SHARES[0], lambda: own.take_in(image))
    sensed = clock.timed(_SHARES[1], lambda: own.sense(image, velocity, error))

    def ask() -> ControlTick:
        _ = image.state.ee_jacobian  # kinematics that are left until somebody asks for them
        return own.tick(action, sensed)

    tick = clock.timed(_SHARES[2], ask)
    qp = own.layer._qp
    clock.timed(QP, lambda: qp.solve(tick))
    clock.add_up(TICK, _SHARES)
    for solver in _SOLVERS:
        name = f"QP: full form, {solver} through qpsolvers"
        clock.timed(name, lambda: solve_reference(qp.problem(tick), solver))  # noqa: B023 called now

    def hfbs() -> None:
        rival.take_in(image)
        rival.layer.command(action, rival.sense(image, velocity, error))

    clock.timed("whole tick of HFBS, five frames", hfbs)


def drive(env: gym.Env[Any, Any], chains: tuple[Chain, Chain], steps: int, clock: Clock) -> None:
    """One episode of HRA; its first ticks warm up and are not counted."""
    planner, ear = PLANNERS["hra"](), Listening()
    inner: Any = env.unwrapped
    inner.fault = ear
    observation, _ = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    for chain in chains:
        chain.reset(ear.heard)
    done, k, cold = False, 0, Clock()
    while not done and k < steps + _WARM_UP:
        action = planner.act(observation)
        observation, _, terminated, truncated, _ = env.step(action)
        error = float(np.linalg.norm(observation["deviation"][:3]))
        known = (action, inner.record.command.velocity, error)
        one_tick(clock if k >= _WARM_UP else cold, *chains, ear.heard, known)
        done, k = terminated or truncated, k + 1


def summary(clock: Clock) -> dict[str, dict[str, float]]:
    """Median and 99th percentile by name."""
    return {
        name: {
            "median_ms": float(np.median(values)),
            "p99_ms": float(np.percentile(values, 99)),
        }
        for name, values in clock.times.items()
    }


def main() -> None:
    """Measure, print and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=250, help="of one episode a scene")
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/control_tick.json"))
    arguments = parser.parse_args()
    clock = Clock()
    for scene in SCENES:
        env = gym.make("horf/Reach-v0", scene=scene, disable_env_checker=True)
        inner: Any = env.unwrapped
        sdf = inner._senses._sdf
        chains = (
            Chain(sdf, SdfQpLayer, PRESETS["default"].memory),
            Chain(sdf, SampledQpLayer, PRESETS["paper"].memory),
        )
        drive(env, chains, arguments.steps, clock)
        env.close()
    times = summary(clock)
    print("| | median / ms | p99 / ms |\n|---|---|---|")
    for name, row in times.items():
        print(f"| {name} | {row['median_ms']:.3f} | {row['p99_ms']:.3f} |")
    ticks = len(clock.times[TICK])
    write_json({**circumstances(), "ticks": ticks, "times": times, "bars": _BARS}, arguments.out)


if __name__ == "__main__":
    main()
