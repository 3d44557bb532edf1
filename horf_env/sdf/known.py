"""Compiled distances to what the robot knows without looking: the floor, and its own points."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.arrays import Shape
from horf_env.sdf.bodies import body_distance, to_body
from horf_env.sdf.kernel import chain_rule
from horf_env.sdf.witnesses import DISTANCE, NORMAL, PLACE
from horf_env.types import FloatArray, IntArray


@njit(cache=True)
def find_lowest(
    vertices: FloatArray,
    vertex_start: IntArray,
    poses: FloatArray,
    jacobians: FloatArray,
    first_body: int,
    numbers: FloatArray,
) -> None:
    """Fill in the lowest corner of each body and its height above the plane z = 0.

    Args:
        vertices: See `BodyGeometry`.
        vertex_start: See `BodyGeometry`.
        poses: T_world_body, shape (B, 4, 4).
        jacobians: See `RobotState.body_jacobians`, shape (B, 6, n).
        first_body: Bodies before this one are passed over.
        numbers: Written, one point a body; see `empty_table`.
    """
    for b in range(first_body, len(poses)):
        pose, lowest, place = poses[b], np.inf, 0
        for v in range(vertex_start[b], vertex_start[b + 1]):
            height = 0.0
            for j in range(3):
                height += pose[2, j] * vertices[v, j]
            if height < lowest:
                lowest, place = height, v
        row = numbers[b, 0]
        for j in range(3):
            row[PLACE + j] = pose[j, 3]
            for i in range(3):
                row[PLACE + j] += pose[j, i] * vertices[place, i]
        row[DISTANCE] = row[PLACE + 2]
        row[NORMAL + 2] = -1.0  # raising the floor shortens the distance
        chain_rule(pose, jacobians[b], row)


@njit(cache=True)
def mark_within(
    shape: Shape,
    heights: FloatArray,
    points: FloatArray,
    poses: FloatArray,
    first_body: int,
    tolerance: float,
    inside: np.ndarray,
) -> None:
    """Mark the points that are nearer than the tolerance [m] to a body from the first one on."""
    for i in range(len(points)):
        inside[i] = False
        for b in range(first_body, len(poses)):
            x, y, z = to_body(poses[b], points, i)
            if _is_beyond(shape.boxes, b, x, y, z, tolerance):
                continue
            if body_distance(shape, heights, b, x, y, z)[0] < tolerance:
                inside[i] = True
                break


@njit(cache=True)
def _is_beyond(boxes: FloatArray, b: int, x: float, y: float, z: float, tolerance: float) -> bool:
    """Whether a point is farther from the box of a body than the tolerance along some axis."""
    return (
        max(boxes[b, 0, 0] - x, x - boxes[b, 1, 0]) > tolerance
        or max(boxes[b, 0, 1] - y, y - boxes[b, 1, 1]) > tolerance
        or max(boxes[b, 0, 2] - z, z - boxes[b, 1, 2]) > tolerance
    )
