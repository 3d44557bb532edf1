"""Time of the distance queries on clouds of real episodes, beside rivals, one thread.

All rivals see the same clouds and take turns; processor time of the thread, median over clouds of
the median over repetitions. Ratios count more than times.

    OMP_NUM_THREADS=1 python benchmarks/sdf_speed.py [--out benchmarks/results/sdf_speed.json]
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from circumstances import circumstances, write_json
from scipy.spatial import cKDTree
from sdf_clouds import PERCEPTIONS, Sample, collect
from sdf_peers import BernsteinField, brute_force

from horf_env.robot import MobileManipulator, collision_parts
from horf_env.sdf import RobotSdf
from horf_env.sdf.geometry import body_geometry

N_POINTS = 4096
OWN = ("query", "witness query at rest", "witness query in motion")
SLOW = ("Bernstein 8^3, torch", "libigl brute force")
_BRAKING, _SPACING, _CUTOFF = 0.5, 0.12, 1.0  # as in the default preset with limits ld60


def queries(samples: list[Sample]) -> dict[str, Callable[[Sample], object]]:
    """What is timed, by name."""
    robot, parts = MobileManipulator.load(), collision_parts()
    sdf = RobotSdf.load(robot)
    boxes = body_geometry(parts).boxes
    bernstein = BernsteinField(sdf, boxes)
    options: dict[str, Any] = {
        "count": 8,
        "spacing": _SPACING,
        "cutoff": _CUTOFF,
        "braking": _BRAKING,
    }
    return {
        OWN[0]: lambda s: sdf.query(s.points, s.state.configuration),
        "distances alone (state given)": lambda s: sdf.witnesses(
            s.points, s.state, count=1, spacing=0.0, cutoff=np.inf
        ),
        OWN[1]: lambda s: sdf.witnesses(s.points, s.state, **options),
        OWN[2]: lambda s: sdf.witnesses(s.points, s.state, velocity=s.velocity, **options),
        "cKDTree, 40 points": lambda s: cKDTree(s.points).query(s.points[:40] + 0.1),
        SLOW[0]: lambda s: bernstein.nearest(s.points, s.state.link_poses),
        SLOW[1]: lambda s: brute_force(parts, s.points, s.state.link_poses),
    }


def measure(samples: list[Sample], repetitions: int) -> dict[str, list[float]]:
    """Median microseconds of each query on each cloud; the queries take turns."""
    timed = queries(samples)
    result: dict[str, list[float]] = {name: [] for name in timed}
    for sample in samples:
        times: dict[str, list[int]] = {name: [] for name in timed}
        for round_ in range(repetitions):
            for name, query in timed.items():
                if name in SLOW and round_ > 0:
                    continue
                query(sample)  # warm
                begin = time.thread_time_ns()
                query(sample)
                times[name].append(time.thread_time_ns() - begin)
        for name, values in times.items():
            result[name].append(float(np.median(values)) / 1e3)
    return result


def summary(samples: list[Sample], times: dict[str, list[float]]) -> dict[str, dict[str, float]]:
    """Medians over the clouds of each perception, and ratios to the query in the same run."""
    kinds = np.array([sample.perception for sample in samples])
    table = {}
    for name, values in times.items():
        row = {
            f"{kind}_us": round(float(np.median(np.array(values)[kinds == kind])), 1)
            for kind in PERCEPTIONS
        }
        ratios = np.array(values) / np.array(times["distances alone (state given)"])
        table[name] = row | {"ratio_to_distances": round(float(np.median(ratios)), 2)}
    return table


def main() -> None:
    """Measure and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=120)
    parser.add_argument("--repetitions", type=int, default=15)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/sdf_speed.json"))
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    samples = collect(N_POINTS, arguments.steps, seed=0)
    times = measure(samples, arguments.repetitions)
    result = {
        **circumstances(),
        "points": N_POINTS,
        "clouds": {k: sum(s.perception == k for s in samples) for k in PERCEPTIONS},
        "times": summary(samples, times),
    }
    write_json(result, arguments.out)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
