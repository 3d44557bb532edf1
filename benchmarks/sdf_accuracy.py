"""How exact are distances and gradients, and what do the fields cost?

Distances to the hulls against libigl's brute force and PyBullet's closest points, those to the
visual meshes against libigl, and the gradient with respect to the nine velocities against
differences of fourth order.

    python benchmarks/sdf_accuracy.py [--points 20000] [--out FILE.json]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from circumstances import circumstances, write_json
from sdf_oracles import ClosestPoints, brute_force
from velocity_gradient import gradient_errors

from horf_env.robot import MeshPart, MobileManipulator, Part, collision_parts, visual_parts
from horf_env.robot.bodies import BODIES
from horf_env.sdf import RobotSdf
from horf_env.sdf.arrays import shape_of
from horf_env.sdf.bodies import measure as measure_distances
from horf_env.sdf.cache import cached_fields
from horf_env.sdf.fields import Fields, build_fields
from horf_env.sdf.geometry import BodyGeometry, body_geometry
from horf_env.types import FloatArray

_AROUND = 0.3  # m around a body; where points outside of it lie
_NEAR = 0.05  # m; how far outside the fields of visual meshes are judged
_OFF = 0.1  # mm; PyBullet's distance differs by more
_LOADS = 9  # times a file is read
_MM = 1e3

Bodies = tuple[tuple[Part, ...], ...]


def sample(
    parts: tuple[Part, ...], rng: np.random.Generator, count: int, low: float, high: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points of a body's surroundings with low < distance < high, their distances and gradients."""
    corners = np.concatenate([part.vertices for part in parts])
    padding = max(high, 0.0) if np.isfinite(high) else _AROUND
    lower, upper = corners.min(axis=0) - padding, corners.max(axis=0) + padding
    kept: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    while sum(len(points) for points, _, _ in kept) < count:
        points = rng.uniform(lower, upper, (count, 3))
        distance, gradient = brute_force(parts, points)
        chosen = (low < distance) & (distance < high)
        kept.append((points[chosen], distance[chosen], gradient[chosen]))
    points, distance, gradient = (
        np.concatenate(group)[:count] for group in zip(*kept, strict=True)
    )
    return points, distance, gradient


def hull_errors(sdf: RobotSdf, bodies: Bodies, count: int, seed: int) -> dict[str, Any]:
    """Greatest differences from libigl [m] and from PyBullet [mm], inside and outside."""
    rng, rows = np.random.default_rng(seed), {}
    with ClosestPoints() as bullet:
        for k, parts in enumerate(bodies):
            row: dict[str, float] = {}
            for side, low, high in (("outside", 0.0, np.inf), ("inside", -np.inf, 0.0)):
                points, distance, _ = sample(parts, rng, count, low, high)
                own = sdf.link_distance(k, points)
                difference = _MM * (bullet.distance(k, points) - own)
                row[f"libigl_{side}_m"] = float(np.abs(own - distance).max())
                row[f"pybullet_{side}_least_mm"] = float(difference.min())
                row[f"pybullet_{side}_greatest_mm"] = float(difference.max())
                row[f"pybullet_{side}_share_off"] = float((np.abs(difference) > _OFF).mean())
            rows[BODIES[k].frame] = row
    return rows


def visual_errors(
    geometry: BodyGeometry, fields: Fields, bodies: Bodies, count: int, seed: int
) -> dict[str, Any]:
    """Errors of distance and direction within `_NEAR`, where the nearest part is not convex."""
    rng, shape, rows = np.random.default_rng(seed), shape_of(geometry, fields), {}
    heights = np.empty(len(geometry.faces))
    errors, angles = [], []
    for k, parts in enumerate(bodies):
        points, distance, gradient = sample(parts, rng, count, 0.0, _NEAR)
        meshes = [part for part in parts if isinstance(part, MeshPart)]
        read = brute_force(meshes, points)[0] == distance
        points, distance, gradient = points[read], distance[read], gradient[read]
        own, slopes = np.empty(len(points)), np.array(points.T, order="C")
        measure_distances(shape, heights, k, slopes, own)
        error = _MM * np.abs(own - distance)
        cosine = np.einsum("ji,ij->i", slopes, gradient) / np.linalg.norm(slopes, axis=0)
        errors.append(error)
        angles.append(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))
        rows[BODIES[k].frame] = _spread(error, angles[-1])
    return {"all": _spread(np.concatenate(errors), np.concatenate(angles)), "bodies": rows}


def _spread(error: FloatArray, angle: FloatArray) -> dict[str, float]:
    return {
        "points": len(error),
        "mean_mm": float(error.mean()),
        "p99_mm": float(np.percentile(error, 99)),
        "max_mm": float(error.max()),
        "gradient_median_degrees": float(np.median(angle)),
    }


def field_costs(geometry: BodyGeometry) -> tuple[Fields, dict[str, float]]:
    """Fields, and what it takes to build, store and read them (processor time)."""
    begin = time.process_time()
    fields = build_fields(geometry)
    built = time.process_time() - begin
    with tempfile.TemporaryDirectory() as name:
        folder, loads = Path(name), []
        cached_fields(geometry, folder)
        (path,) = folder.iterdir()
        for _ in range(_LOADS):
            begin = time.process_time()
            cached_fields(geometry, folder)
            loads.append(time.process_time() - begin)
        size = path.stat().st_size
    costs = {"build_s": built, "file_mb": size / 1e6, "load_ms": _MM * float(np.median(loads))}
    return fields, costs


def measure(count: int, states: int, seed: int) -> dict[str, Any]:
    """Everything."""
    robot, hulls, visuals = MobileManipulator.load(), collision_parts(), visual_parts()
    sdf = RobotSdf.load(robot)  # compiles the kernels, too
    _, hull_costs = field_costs(body_geometry(hulls))
    geometry = body_geometry(visuals)
    build_fields(body_geometry([visuals[0][-1:]]))  # a small mesh; compiles, too
    fields, visual_costs = field_costs(geometry)
    return {
        "hull": hull_errors(sdf, hulls, count, seed),
        "visual": visual_errors(geometry, fields, visuals, count, seed),
        "gradient": gradient_errors(robot, sdf, hulls, states, seed),
        "fields": {"hull": hull_costs, "visual": visual_costs},
    }


def main() -> None:
    """Measure, print and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=20_000, help="a body, inside and outside")
    parser.add_argument("--states", type=int, default=200, help="for the gradient")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/sdf_accuracy.json"))
    arguments = parser.parse_args()
    result = measure(arguments.points, arguments.states, arguments.seed)
    for body, row in result["hull"].items():
        print(f"{body:12}", *(f"{name} {value:.2g}" for name, value in row.items()), sep="  ")
    for name in ("visual", "gradient", "fields"):
        print(name, result[name].get("all", result[name]))
    options = {"points": arguments.points, "states": arguments.states, "seed": arguments.seed}
    write_json({**circumstances(), **options, **result}, arguments.out)


if __name__ == "__main__":
    main()
