"""An even cover of all obstacle surfaces by points: what a perfect sensor would know."""

from __future__ import annotations

import numpy as np

from horf_env.scenes.scene import Box, Cylinder, Scene, Sphere
from horf_env.types import FloatArray

_STEP_PER_SPACING = 1.3
"""A grid of step s leaves no point farther than s / sqrt(2); 8 % are kept for bent surfaces."""


def surface_points(scene: Scene, spacing: float) -> FloatArray:
    """Points on the true surfaces, so that each surface point above the floor has one near it.

    Deterministic. What lies below the floor is left out, and so are faces that stand on it, and
    the floor itself.

    Args:
        scene: The scene.
        spacing: Greatest distance from a point of a surface to the nearest sample, m.

    Returns:
        Shape (N, 3), m.

    Raises:
        ValueError: If the spacing is not positive.
    """
    if not spacing > 0:
        raise ValueError(f"spacing: expected a length > 0 m, got {spacing}")
    step = _STEP_PER_SPACING * spacing
    parts = [
        *(_box_points(box, step) for box in scene.boxes),
        *(_cylinder_points(cylinder, step) for cylinder in scene.cylinders),
        *(_sphere_points(sphere, step) for sphere in scene.spheres),
    ]
    return np.vstack([np.empty((0, 3)), *parts])


def _ticks(low: float, high: float, step: float) -> FloatArray:
    """Evenly spaced numbers from low to high, both included, at most `step` apart."""
    return np.linspace(low, high, int(np.ceil((high - low) / step)) + 1)


def _visible(center_z: float, half_height: float) -> tuple[float, float] | None:
    """Heights (low, high) of the part above the floor, if any."""
    low, high = max(center_z - half_height, 0.0), center_z + half_height
    return (low, high) if high > 0 else None


def _end_heights(low: float, high: float) -> tuple[float, ...]:
    """Heights of the horizontal faces that are not on or under the floor."""
    return (low, high) if low > 0 else (high,)


def _box_points(box: Box, step: float) -> FloatArray:
    heights = _visible(box.center[2], box.half_extents[2])
    if heights is None:
        return np.empty((0, 3))
    a, b, _ = box.half_extents
    x, y, z = _ticks(-a, a, step), _ticks(-b, b, step), _ticks(*heights, step)
    faces = [
        *(_grid(np.array([sx]), y, z) for sx in (-a, a)),
        *(_grid(x, np.array([sy]), z) for sy in (-b, b)),
        *(_grid(x, y, np.array([sz])) for sz in _end_heights(*heights)),
    ]
    local = np.vstack(faces)
    cos, sin = np.cos(box.yaw), np.sin(box.yaw)
    points = local @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    placed: FloatArray = points + np.array([box.center[0], box.center[1], 0.0])
    return placed


def _grid(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)


def _ring(radius: float, step: float) -> FloatArray:
    """Points of a horizontal circle about the origin, shape (N, 2)."""
    count = max(int(np.ceil(2 * np.pi * radius / step)), 1)
    angle = 2 * np.pi * np.arange(count) / count
    circle: FloatArray = np.column_stack([np.cos(angle), np.sin(angle)])
    return circle * radius


def _cylinder_points(cylinder: Cylinder, step: float) -> FloatArray:
    heights = _visible(cylinder.center[2], cylinder.half_height)
    if heights is None:
        return np.empty((0, 3))
    rim = _ring(cylinder.radius, step)
    disc = np.vstack([_ring(r, step) for r in _ticks(0.0, cylinder.radius, step)])
    side = [_at_height(rim, z) for z in _ticks(*heights, step)]
    ends = [_at_height(disc, z) for z in _end_heights(*heights)]
    points: FloatArray = np.vstack([*side, *ends]) + np.array([*cylinder.center[:2], 0.0])
    return points


def _sphere_points(sphere: Sphere, step: float) -> FloatArray:
    height = sphere.center[2]
    if height <= -sphere.radius:
        return np.empty((0, 3))
    # Polar angle from the top down to the floor, or to the lowest point.
    last = np.arccos(np.clip(-height / sphere.radius, -1.0, 1.0))
    rings = [
        _at_height(_ring(sphere.radius * np.sin(polar), step), sphere.radius * np.cos(polar))
        for polar in _ticks(0.0, last, step / sphere.radius)
    ]
    points: FloatArray = np.vstack(rings) + np.array(sphere.center)
    return points


def _at_height(points: FloatArray, z: float) -> FloatArray:
    return np.column_stack([points, np.full(len(points), z)])
