"""Compiled distances to what the robot knows without looking: the floor, and its own points."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.arrays import Shape, work_of
from horf_env.sdf.bodies import mark_near
from horf_env.sdf.kernel import chain_rule
from horf_env.sdf.scan import SCAN_ERROR, box_distances, chunk_minima, load
from horf_env.sdf.shortlist import shortlist
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
    arrays: tuple[np.ndarray, ...],
    single: np.ndarray,
    minima: np.ndarray,
    double: FloatArray,
    listed: IntArray,
    heights: FloatArray,
    points: FloatArray,
    poses: FloatArray,
    first_body: int,
    tolerance: float,
    inside: np.ndarray,
) -> bool:
    """Mark the points that are nearer than the tolerance to a body from the first one on.

    Args:
        arrays: Those of `Shape`, as a plain tuple.
        single: See `WorkSpace`, for at least N points.
        minima: See `WorkSpace`.
        double: See `WorkSpace`.
        listed: See `WorkSpace`.
        heights: See `WorkSpace`.
        points: Cloud in the world, shape (N, 3), m.
        poses: T_world_body, shape (B, 4, 4).
        first_body: Bodies before this one are passed over.
        tolerance: In m.
        inside: Read and written, shape (N,); False at first.

    Returns:
        False if a coordinate is not finite; nothing is marked then.
    """
    shape, n = Shape(*arrays), len(points)
    work = work_of(n, single, minima, double, listed, heights)
    origin, near = poses[0, :3, 3].copy(), np.empty((4, 4))
    if not load(points, origin, work.cloud):
        return False
    for b in range(first_body, len(poses)):
        near[:] = poses[b]
        near[:3, 3] -= origin
        reach = tolerance + SCAN_ERROR
        box_distances(work.cloud, n, near, shape.boxes[b], reach, work.squared)
        chunk_minima(work.squared.view(np.int32), work.squared_minima.view(np.int32))
        found = shortlist(work.squared, work.squared_minima, reach * reach, work.listed)
        listed = work.listed[:found]
        mark_near(shape, work.heights, b, poses[b], points, listed, tolerance, inside)
    return True
