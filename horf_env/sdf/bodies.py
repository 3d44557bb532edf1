"""Distance of a point to a body: a union of parts, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.arrays import Shape
from horf_env.sdf.fields import bounds
from horf_env.sdf.hermite import field_distance
from horf_env.sdf.polytope import outside_distance, polytope_distance
from horf_env.types import FloatArray


@njit(cache=True)
def to_body(pose: FloatArray, points: FloatArray, i: int) -> tuple[float, float, float]:
    """World point i in the frame of a body with the given pose."""
    dx, dy, dz = points[i, 0] - pose[0, 3], points[i, 1] - pose[1, 3], points[i, 2] - pose[2, 3]
    return (
        pose[0, 0] * dx + pose[1, 0] * dy + pose[2, 0] * dz,
        pose[0, 1] * dx + pose[1, 1] * dy + pose[2, 1] * dz,
        pose[0, 2] * dx + pose[1, 2] * dy + pose[2, 2] * dz,
    )


@njit(cache=True)
def part_distance(
    shape: Shape, heights: FloatArray, part: int, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Distance of a point to a part, and its gradient in the frame of the body.

    Exact for a convex part, for any other as exact as its field. A point that is outside by the
    fields is not measured against all face planes.
    """
    start, stop = shape.part_start[part], shape.part_start[part + 1]
    if start == stop:
        return field_distance(shape.nodes, shape.frames, shape.part_boxes, part, x, y, z)
    low, _, row = bounds(shape.nodes, shape.frames, part, x, y, z)
    if low > 0.0:
        face = shape.near_faces[row]
        d, gx, gy, gz, _ = outside_distance(shape.faces, shape.links, face, x, y, z)
    else:
        d, gx, gy, gz, _ = polytope_distance(
            shape.planes, shape.faces, shape.links, heights, start, stop, x, y, z
        )
    return d, gx, gy, gz


@njit(cache=True)
def body_distance(
    shape: Shape, heights: FloatArray, body: int, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Distance of a point to a body, and its gradient in the frame of the body.

    Inside, it is the distance to the surface of the part in which the point is deepest.
    """
    best, nx, ny, nz = np.inf, 0.0, 0.0, 0.0
    for part in range(shape.body_start[body], shape.body_start[body + 1]):
        d, gx, gy, gz = part_distance(shape, heights, part, x, y, z)
        if d < best:
            best, nx, ny, nz = d, gx, gy, gz
    return best, nx, ny, nz


@njit(cache=True)
def is_within(
    shape: Shape, heights: FloatArray, body: int, x: float, y: float, z: float, tolerance: float
) -> bool:
    """Whether the distance of a point to a body is below a tolerance [m].

    Most points are far from the surface or on it: the fields' bounds tell of the former, and the
    triangles about the nearest one of the latter, without a look at all the planes of a part.
    """
    for part in range(shape.body_start[body], shape.body_start[body + 1]):
        if shape.part_start[part] < shape.part_start[part + 1]:
            low, _, row = bounds(shape.nodes, shape.frames, part, x, y, z)
            if low >= tolerance:
                continue
            face = shape.near_faces[row]
            # No less than the distance, as it is that of some point of the surface.
            if outside_distance(shape.faces, shape.links, face, x, y, z)[0] < tolerance:
                return True
        if part_distance(shape, heights, part, x, y, z)[0] < tolerance:
            return True
    return False


@njit(cache=True)
def body_distances(
    shape: Shape, heights: FloatArray, body: int, points: FloatArray, distances: FloatArray
) -> None:
    """Distances (N,) of points (N, 3) in the frame of a body."""
    for i in range(len(points)):
        distances[i] = body_distance(
            shape, heights, body, points[i, 0], points[i, 1], points[i, 2]
        )[0]
