"""Distance of a point to a body: a union of parts, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.arrays import Shape
from horf_env.sdf.fields import bounds
from horf_env.sdf.hermite import field_distance
from horf_env.sdf.polytope import outside_distance, polytope_distance
from horf_env.types import FloatArray, IntArray


@njit(cache=True)
def to_body(pose: FloatArray, points: FloatArray, i: int) -> tuple[float, float, float]:
    """World point i in the frame of a body with the given pose."""
    dx, dy, dz = points[i, 0] - pose[0, 3], points[i, 1] - pose[1, 3], points[i, 2] - pose[2, 3]
    return (
        pose[0, 0] * dx + pose[1, 0] * dy + pose[2, 0] * dz,
        pose[0, 1] * dx + pose[1, 1] * dy + pose[2, 1] * dz,
        pose[0, 2] * dx + pose[1, 2] * dy + pose[2, 2] * dz,
    )


@njit(cache=True, inline="always")
def part_distance(
    nodes: np.ndarray,
    near_faces: np.ndarray,
    frames: FloatArray,
    part_boxes: FloatArray,
    planes: FloatArray,
    faces: FloatArray,
    links: np.ndarray,
    heights: FloatArray,
    part: int,
    start: int,
    stop: int,
    x: float,
    y: float,
    z: float,
) -> tuple[float, float, float, float]:
    """Distance of a point to a part, and its gradient in the frame of the body.

    Exact for a convex part, for any other as exact as its field. A point that is outside by the
    fields is not measured against all face planes. Takes the arrays of `Shape` one by one and is
    copied into its callers' loops: to take them out of the bundle costs as much as the arithmetic.
    """
    if start == stop:
        d, gx, gy, gz = field_distance(nodes, frames, part_boxes, part, x, y, z)
    else:
        low, _, row = bounds(nodes, frames, part, x, y, z)
        if low > 0.0:
            d, gx, gy, gz, _ = outside_distance(faces, links, near_faces[row], x, y, z)
        else:
            d, gx, gy, gz, _ = polytope_distance(
                planes, faces, links, heights, start, stop, x, y, z
            )
    return d, gx, gy, gz


@njit(cache=True, inline="always")
def measure(
    shape: Shape, heights: FloatArray, body: int, local: FloatArray, distances: FloatArray
) -> None:
    """Distances of points to a body, and their gradients in the frame of the body.

    Inside, it is the distance to the surface of the part in which the point is deepest.

    Args:
        shape: The bodies.
        heights: See `Work`.
        body: Index of the body.
        local: Points in the frame of the body, shape (3, >= N), m; the gradients take their place.
        distances: Written, shape (N,), m.
    """
    nodes, near_faces, frames, boxes = shape.nodes, shape.near_faces, shape.frames, shape.part_boxes
    planes, faces, links, starts = shape.planes, shape.faces, shape.links, shape.part_start
    first, last = shape.body_start[body], shape.body_start[body + 1]
    for m in range(len(distances)):
        x, y, z = local[0, m], local[1, m], local[2, m]
        best, nx, ny, nz = np.inf, 0.0, 0.0, 0.0
        for part in range(first, last):
            start, stop = starts[part], starts[part + 1]
            d, gx, gy, gz = part_distance(
                nodes,
                near_faces,
                frames,
                boxes,
                planes,
                faces,
                links,
                heights,
                part,
                start,
                stop,
                x,
                y,
                z,
            )
            if d < best:
                best, nx, ny, nz = d, gx, gy, gz
        distances[m], local[0, m], local[1, m], local[2, m] = best, nx, ny, nz


@njit(cache=True)
def mark_near(
    shape: Shape,
    heights: FloatArray,
    body: int,
    pose: FloatArray,
    points: FloatArray,
    listed: IntArray,
    tolerance: float,
    inside: np.ndarray,
) -> None:
    """Mark those of the listed points whose distance to a body is below a tolerance.

    Most points are far from the surface or on it: the fields' bounds tell of the former, and the
    triangles about the nearest one of the latter, without a look at all the planes of a part.

    Args:
        shape: The bodies.
        heights: See `Work`.
        body: Index of the body.
        pose: T_world_body, shape (4, 4).
        points: Cloud in the world, shape (N, 3), m.
        listed: Indices of points, shape (L,).
        tolerance: In m.
        inside: Read and written, shape (N,).
    """
    nodes, near_faces, frames, boxes = shape.nodes, shape.near_faces, shape.frames, shape.part_boxes
    planes, faces, links, starts = shape.planes, shape.faces, shape.links, shape.part_start
    for part in range(shape.body_start[body], shape.body_start[body + 1]):
        start, stop = starts[part], starts[part + 1]
        for m in range(len(listed)):
            i = listed[m]
            if inside[i]:
                continue
            x, y, z = to_body(pose, points, i)
            if start < stop:
                low, _, row = bounds(nodes, frames, part, x, y, z)
                if low >= tolerance:
                    continue
                # No less than the distance, as it is that of some point of the surface.
                if outside_distance(faces, links, near_faces[row], x, y, z)[0] < tolerance:
                    inside[i] = True
                    continue
            d, _, _, _ = part_distance(
                nodes,
                near_faces,
                frames,
                boxes,
                planes,
                faces,
                links,
                heights,
                part,
                start,
                stop,
                x,
                y,
                z,
            )
            inside[i] = d < tolerance
