"""Exact distances from points to the obstacles of a scene (the floor is not one of them)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from horf_env.scenes.scene import Box, Cylinder, Scene, Sphere
from horf_env.types import FloatArray


def obstacle_distance(scene: Scene, points: FloatArray) -> FloatArray:
    """Signed distance to the nearest obstacle.

    Args:
        scene: The scene.
        points: Shape (N, 3), m.

    Returns:
        Shape (N,), m; negative inside an obstacle, infinite without obstacles.
    """
    columns = [
        _box_distance(points, scene.boxes, dimensions=3),
        _cylinder_distance(points, scene.cylinders),
        _ball_distance(points, scene.spheres, dimensions=3),
    ]
    return _least(columns)


def outline_distance(scene: Scene, points: FloatArray) -> FloatArray:
    """Signed distance to the nearest outline of an obstacle seen from above, at whatever height.

    Args:
        scene: The scene.
        points: Shape (N, 2), m.

    Returns:
        Shape (N,), m; negative above, in or under an obstacle, infinite without obstacles.
    """
    columns = [
        _box_distance(points, scene.boxes, dimensions=2),
        _ball_distance(points, (*scene.cylinders, *scene.spheres), dimensions=2),
    ]
    return _least(columns)


def _least(columns: list[FloatArray]) -> FloatArray:
    least: FloatArray = np.hstack(columns).min(axis=1, initial=np.inf)
    return least


def _combine(excess: FloatArray) -> FloatArray:
    """Distance to a product of intervals from the excess (..., K) over each interval's end."""
    distance: FloatArray = np.linalg.norm(np.maximum(excess, 0.0), axis=-1)
    distance += np.minimum(excess.max(axis=-1), 0.0)
    return distance


def _offsets(points: FloatArray, centers: FloatArray) -> FloatArray:
    return points[:, None, :] - centers[None, :, :]


def _box_distance(points: FloatArray, boxes: Sequence[Box], *, dimensions: int) -> FloatArray:
    """Distance of each point to each box, shape (N, B)."""
    if not boxes:
        return np.empty((len(points), 0))
    offset = _offsets(points, np.array([b.center[:dimensions] for b in boxes]))
    yaw = np.array([b.yaw for b in boxes])
    cos, sin = np.cos(yaw), np.sin(yaw)
    local = offset.copy()
    local[..., 0] = cos * offset[..., 0] + sin * offset[..., 1]
    local[..., 1] = cos * offset[..., 1] - sin * offset[..., 0]
    return _combine(np.abs(local) - np.array([b.half_extents[:dimensions] for b in boxes]))


def _cylinder_distance(points: FloatArray, cylinders: Sequence[Cylinder]) -> FloatArray:
    """Distance of each point to each cylinder, shape (N, C)."""
    if not cylinders:
        return np.empty((len(points), 0))
    offset = _offsets(points, np.array([c.center for c in cylinders]))
    radial = np.hypot(offset[..., 0], offset[..., 1]) - np.array([c.radius for c in cylinders])
    axial = np.abs(offset[..., 2]) - np.array([c.half_height for c in cylinders])
    return _combine(np.stack([radial, axial], axis=-1))


def _ball_distance(
    points: FloatArray, balls: Sequence[Cylinder | Sphere], *, dimensions: int
) -> FloatArray:
    """Distance of each point to each ball (a disc in two dimensions), shape (N, S)."""
    if not balls:
        return np.empty((len(points), 0))
    offset = _offsets(points, np.array([b.center[:dimensions] for b in balls]))
    distance: FloatArray = np.linalg.norm(offset, axis=-1)
    distance -= np.array([b.radius for b in balls])
    return distance
