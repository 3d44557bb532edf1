"""Exact signed distance from points to convex polytopes, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray


@njit(cache=True)
def convex_distance(
    point: FloatArray,
    planes: FloatArray,
    triangles: FloatArray,
    spheres: FloatArray,
    start: int,
    stop: int,
    normal: FloatArray,
) -> float:
    """Signed distance of a point to one convex part, positive outside [m].

    Inside, the distance is that to the nearest face plane (exact for a convex body); outside, the
    distance to the nearest triangle. On a tie the first face wins, so the normal is always finite.

    Args:
        point: Shape (3,), frame of the part.
        planes: All planes, shape (F, 4).
        triangles: All triangles, shape (F, 3, 3).
        spheres: Ball around each triangle, shape (F, 4).
        start: First triangle of the part.
        stop: One past its last triangle.
        normal: Written: unit gradient of the distance, shape (3,).
    """
    highest, face = -np.inf, start
    for f in range(start, stop):
        height = (
            planes[f, 0] * point[0]
            + planes[f, 1] * point[1]
            + planes[f, 2] * point[2]
            - planes[f, 3]
        )
        if height > highest:
            highest, face = height, f
    normal[0], normal[1], normal[2] = planes[face, 0], planes[face, 1], planes[face, 2]
    if highest <= 0.0:
        return highest
    x, y, z = point[0], point[1], point[2]
    best = _triangle_offset(x, y, z, triangles, face, normal)
    offset = np.empty(3)
    for f in range(start, stop):
        dx, dy, dz = x - spheres[f, 0], y - spheres[f, 1], z - spheres[f, 2]
        reach = best + spheres[f, 3]
        if f == face or dx * dx + dy * dy + dz * dz >= reach * reach:
            continue
        distance = _triangle_offset(x, y, z, triangles, f, offset)
        if distance < best:
            best = distance
            normal[:] = offset
    if best > 0.0:
        normal /= best
    return best


@njit(cache=True)
def _triangle_offset(
    x: float, y: float, z: float, triangles: FloatArray, f: int, offset: FloatArray
) -> float:
    """Write (x, y, z) - (nearest point of triangle f); return its length.

    Finds the Voronoi region of the triangle (corner, edge or face) in which the point lies. Takes
    the whole array and an index: a view of one triangle would cost as much as the arithmetic.
    """
    a0, a1, a2 = triangles[f, 0, 0], triangles[f, 0, 1], triangles[f, 0, 2]
    ab0, ab1, ab2 = triangles[f, 1, 0] - a0, triangles[f, 1, 1] - a1, triangles[f, 1, 2] - a2
    ac0, ac1, ac2 = triangles[f, 2, 0] - a0, triangles[f, 2, 1] - a1, triangles[f, 2, 2] - a2
    ap0, ap1, ap2 = x - a0, y - a1, z - a2
    d1 = ab0 * ap0 + ab1 * ap1 + ab2 * ap2
    d2 = ac0 * ap0 + ac1 * ap1 + ac2 * ap2
    bb = ab0 * ab0 + ab1 * ab1 + ab2 * ab2
    bc = ab0 * ac0 + ab1 * ac1 + ab2 * ac2
    cc = ac0 * ac0 + ac1 * ac1 + ac2 * ac2
    d3, d4 = d1 - bb, d2 - bc  # the same products seen from corner b
    d5, d6 = d1 - bc, d2 - cc  # and from corner c
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        s, t = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        s, t = 1.0, 0.0
    elif d6 >= 0.0 and d5 <= d6:
        s, t = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, t = d1 / (d1 - d3), 0.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, t = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s = 1.0 - t
    else:
        s, t = vb / (va + vb + vc), vc / (va + vb + vc)
    offset[0] = ap0 - s * ab0 - t * ac0
    offset[1] = ap1 - s * ab1 - t * ac1
    offset[2] = ap2 - s * ab2 - t * ac2
    return np.sqrt(offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2)


@njit(cache=True)
def part_distances(
    points: FloatArray,
    planes: FloatArray,
    triangles: FloatArray,
    spheres: FloatArray,
    start: int,
    stop: int,
) -> FloatArray:
    """Signed distances (N,) of points (N, 3) to one part [m]; the other arguments as above."""
    distances = np.empty(len(points))
    normal = np.empty(3)
    for i in range(len(points)):
        distances[i] = convex_distance(points[i], planes, triangles, spheres, start, stop, normal)
    return distances
