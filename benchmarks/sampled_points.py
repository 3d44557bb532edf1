"""Forty sampled points (HFBS) against SDF rows: time and error of the distances, same states.

One process, one thread, alternating. The truth is the exact distance of the nearest point.

    python benchmarks/sampled_points.py [--count 10000] [--out FILE.json]
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from circumstances import circumstances, write_json
from control_states import episode_states
from processor_time import timed

from horf_env.control import PRESETS, Sensed
from horf_env.control.sampled_qp_layer import SampledQpLayer
from horf_env.control.sdf_qp_layer import SdfQpLayer
from horf_env.robot import LIMITS, MobileManipulator
from horf_env.sdf import RobotSdf
from horf_env.task import STEP
from horf_env.types import FloatArray

_NEAR = 0.1  # m; distances that matter to an avoidance row


def nearest(layer: SdfQpLayer, sensed: Sensed) -> tuple[FloatArray, float]:
    """Distance of each body as a layer sees it, and the microseconds of processor time it takes."""
    witnesses, microseconds = timed(layer._obstacles, sensed)
    return witnesses.distance[:, 0], microseconds


def measure(count: int, seed: int) -> dict[str, Any]:
    """Errors of the distances below `_NEAR`, and times."""
    sdf = RobotSdf.load(MobileManipulator.load())
    arguments = (sdf, LIMITS["ld60"], PRESETS["default"], STEP)
    layers = {"sdf": SdfQpLayer(*arguments), "sampled": SampledQpLayer(*arguments)}
    times: dict[str, list[float]] = {name: [] for name in layers}
    errors: dict[str, list[FloatArray]] = {name: [] for name in layers}
    points = []
    for _, sensed in episode_states(count, seed):
        points.append(len(sensed.points))
        truth = sdf.query(sensed.points, sensed.state.configuration).distance
        near = truth < _NEAR
        for name, layer in layers.items():
            distance, microseconds = nearest(layer, sensed)
            times[name].append(microseconds)
            errors[name].append(distance[near] - truth[near])
    return {
        "median_points": float(np.median(points)),
        **{name: _summary(times[name], np.concatenate(errors[name])) for name in layers},
    }


def _summary(times: list[float], errors: FloatArray) -> dict[str, float]:
    finite = errors[np.isfinite(errors)]
    return {
        "median_us": float(np.median(times)),
        "mean_mm": float(1e3 * finite.mean()),
        "p99_mm": float(1e3 * np.percentile(finite, 99)),
        "max_mm": float(1e3 * finite.max()),
        "distances": len(errors),
        "not_seen": int(len(errors) - len(finite)),
    }


def main() -> None:
    """Measure and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/sampled_points.json"))
    arguments = parser.parse_args()
    result = {
        **circumstances(),
        "threads": os.environ.get("OMP_NUM_THREADS", "all"),
        "count": arguments.count,
        "seed": arguments.seed,
        **measure(arguments.count, arguments.seed),
    }
    write_json(result, arguments.out)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
