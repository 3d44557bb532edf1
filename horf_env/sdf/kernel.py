"""Compiled search for the cloud points that matter to each body: nearest, and most critical.

For each body: bound the distance of every point from below by the bounding box, in vector code;
find the nearest point exactly; pick further witness points in the order of what is left of their
distance after braking, well apart from each other; measure those exactly.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.arrays import Shape, Work, work_of
from horf_env.sdf.bodies import measure, to_body
from horf_env.sdf.nearest import nearest_point
from horf_env.sdf.scan import box_distances, braking_distances, chunk_minima, distances, load
from horf_env.sdf.selection import further_witnesses
from horf_env.sdf.witnesses import DISTANCE, GRADIENT, NORMAL, PLACE
from horf_env.types import FloatArray, IntArray


@njit(cache=True)
def find_witnesses(
    arrays: tuple[np.ndarray, ...],
    single: np.ndarray,
    minima: np.ndarray,
    double: FloatArray,
    listed: IntArray,
    heights: FloatArray,
    points: FloatArray,
    poses: FloatArray,
    jacobians: FloatArray,
    velocity: FloatArray,
    first_body: int,
    cutoff: float,
    spacing: FloatArray,
    braking: float,
    numbers: FloatArray,
    indices: IntArray,
) -> bool:
    """Fill the witness points of all bodies; places without a point keep what they hold.

    Args:
        arrays: Those of `Shape`, as a plain tuple.
        single: See `WorkSpace`, for at least N points.
        minima: See `WorkSpace`.
        double: See `WorkSpace`.
        listed: See `WorkSpace`.
        heights: See `WorkSpace`.
        points: Cloud in the world, shape (N, 3), m.
        poses: T_world_body, shape (B, 4, 4).
        jacobians: See `RobotState.body_jacobians`, shape (B, 6, n).
        velocity: Of the robot, shape (n,).
        first_body: Bodies before this one are passed over.
        cutoff: Points that stay farther than this from a body even if it brakes only now [m] are
            left out.
        spacing: Least distance between two witness points of each body [m], shape (B,).
        braking: Deceleration behind the order of the witness points [m/s^2]; inf for none.
        numbers: Written, the answers; see `empty_table`.
        indices: Written, index into the cloud, shape (B, K); the nearest first.

    Returns:
        False if a coordinate is not finite; nothing is written then.
    """
    shape = Shape(*arrays)
    work = work_of(len(points), single, minima, double, listed, heights)
    origin, twist, near = poses[0, :3, 3].copy(), np.empty(6), np.empty((4, 4))
    if not load(points, origin, work.cloud):
        return False
    for b in range(first_body, len(poses)):
        pose = poses[b]
        _twist(pose, jacobians[b], velocity, twist)
        near[:] = pose
        near[:3, 3] -= origin
        way = _longest_braking_way(twist, shape.boxes[b], braking)
        _scan(shape.boxes[b], work, len(points), near, twist, cutoff, braking, way)
        nearest, distance, nx, ny, nz = nearest_point(shape, work, b, pose, points)
        if nearest < 0:
            continue
        indices[b, 0] = nearest
        _write(pose, jacobians[b], points, nearest, distance, nx, ny, nz, numbers[b, 0])
        if indices.shape[1] == 1:
            continue
        if way == 0.0:
            distances(work.squared, work.keys)
        count = further_witnesses(shape, work, b, pose, points, spacing[b], indices[b])
        for k in range(1, count):
            x, y, z = to_body(pose, points, indices[b, k])
            work.local[0, k], work.local[1, k], work.local[2, k] = x, y, z
        measure(shape, work.heights, b, work.local[:, 1:], work.lower[1:count])
        for k in range(1, count):
            distance, nx, ny, nz = (
                work.lower[k],
                work.local[0, k],
                work.local[1, k],
                work.local[2, k],
            )
            _write(pose, jacobians[b], points, indices[b, k], distance, nx, ny, nz, numbers[b, k])
    return True


@njit(cache=True)
def _twist(pose: FloatArray, jacobian: FloatArray, velocity: FloatArray, twist: FloatArray) -> None:
    """Write the velocity of a body (linear at its origin; angular) in its own frame, shape (6,)."""
    twist[:] = 0.0
    for row in range(6):
        speed = 0.0
        for j in range(len(velocity)):
            speed += jacobian[row, j] * velocity[j]
        for k in range(3):
            twist[row - row % 3 + k] += pose[row % 3, k] * speed


@njit(cache=True)
def _longest_braking_way(twist: FloatArray, box: FloatArray, braking: float) -> float:
    """No point of the box needs a longer way to stop [m]."""
    linear = np.sqrt(twist[0] ** 2 + twist[1] ** 2 + twist[2] ** 2)
    angular = np.sqrt(twist[3] ** 2 + twist[4] ** 2 + twist[5] ** 2)
    reach = 0.0
    for j in range(3):
        reach += max(abs(box[0, j]), abs(box[1, j])) ** 2
    return 0.5 * (linear + angular * np.sqrt(reach)) ** 2 / braking


@njit(cache=True, inline="always")
def _scan(
    box: FloatArray,
    work: Work,
    n: int,
    near: FloatArray,
    twist: FloatArray,
    cutoff: float,
    braking: float,
    way: float,
) -> None:
    """Fill squared distances and their chunk minima for one body; keys too if it moves."""
    cloud, squared = work.cloud, work.squared
    if way > 0.0:
        braking_distances(cloud, n, near, box, twist, braking, way, cutoff, squared, work.keys)
    else:
        box_distances(cloud, n, near, box, cutoff, squared)
    chunk_minima(squared.view(np.int32), work.squared_minima.view(np.int32))


@njit(cache=True, inline="always")
def _write(
    pose: FloatArray,
    jacobian: FloatArray,
    points: FloatArray,
    i: int,
    distance: float,
    nx: float,
    ny: float,
    nz: float,
    row: FloatArray,
) -> None:
    """Write one answer from a distance and its gradient in the frame of the body."""
    row[DISTANCE] = distance
    for j in range(3):
        row[NORMAL + j] = pose[j, 0] * nx + pose[j, 1] * ny + pose[j, 2] * nz
        row[PLACE + j] = points[i, j]
    chain_rule(pose, jacobian, row)


@njit(cache=True)
def chain_rule(pose: FloatArray, jacobian: FloatArray, row: FloatArray) -> None:
    """Write d distance / d velocity of a world-fixed point into its row, from normal and place.

    The distance falls as fast as the body-fixed point under the world point moves along the normal:
    d zeta / d velocity = -normal . J_point.
    """
    ax, ay, az = row[PLACE] - pose[0, 3], row[PLACE + 1] - pose[1, 3], row[PLACE + 2] - pose[2, 3]
    nx, ny, nz = row[NORMAL], row[NORMAL + 1], row[NORMAL + 2]
    tx, ty, tz = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    for j in range(jacobian.shape[1]):
        linear = nx * jacobian[0, j] + ny * jacobian[1, j] + nz * jacobian[2, j]
        angular = tx * jacobian[3, j] + ty * jacobian[4, j] + tz * jacobian[5, j]
        row[GRADIENT + j] = -(linear + angular)
