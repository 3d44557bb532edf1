"""Exact signed distance from points to convex polytopes, compiled.

Helpers take few arrays: numba counts references to each array at each call, which would cost as
much as the arithmetic.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray

# All numbers here are finite, so that minima need not care about NaN and compile to vector code.
FAST = {"nnan", "nsz", "contract", "arcp"}

Nearest = tuple[float, float, float, float, int]
"""Distance [m], its unit gradient, and the face that holds the nearest point."""

_FACE = 6  # region code of the inside of a triangle; 0-2 edges ab, ac, bc; 3-5 corners a, b, c


@njit(cache=True, fastmath=FAST, error_model="numpy")
def polytope_distance(
    planes: FloatArray,
    faces: FloatArray,
    links: np.ndarray,
    heights: FloatArray,
    start: int,
    stop: int,
    x: float,
    y: float,
    z: float,
) -> Nearest:
    """Signed distance of a point to one convex part, positive outside [m], and its gradient.

    Inside, the distance is that to the nearest face plane, exact for a convex body. Where several
    faces are equally near, the first one found gives the gradient; a point on the surface gets the
    normal of a face. So the gradient is finite everywhere.

    Args:
        planes: See `BodyGeometry`, shape (4, F).
        faces: See `BodyGeometry`, shape (F, 12).
        links: See `BodyGeometry`.
        heights: Work space, shape (F,).
        start: First face of the part.
        stop: One past its last face.
        x: Of the point, frame of the part [m].
        y: As x.
        z: As x.
    """
    highest = -np.inf
    for f in range(start, stop):
        height = planes[0, f] * x + planes[1, f] * y + planes[2, f] * z - planes[3, f]
        heights[f] = height
        highest = max(highest, height)
    face = start
    while heights[face] < highest:
        face += 1
    if highest <= 0.0:
        return highest, planes[0, face], planes[1, face], planes[2, face], face
    distance, nx, ny, nz, nearest = outside_distance(faces, links, face, x, y, z)
    if distance == 0.0:  # nearer to the face than numbers can tell
        return 0.0, planes[0, face], planes[1, face], planes[2, face], face
    return distance, nx, ny, nz, nearest


@njit(cache=True, fastmath=FAST, error_model="numpy")
def outside_distance(
    faces: FloatArray, links: np.ndarray, face: int, x: float, y: float, z: float
) -> Nearest:
    """Distance of a point outside the part, by a walk from triangle to triangle.

    If no triangle around the nearest point of a triangle is nearer, that point is a local minimum
    of the distance on the part, hence the global one: part and distance are convex.

    Args:
        faces: See `BodyGeometry`.
        links: See `BodyGeometry`.
        face: Where to begin; the nearer to the answer, the shorter the walk.
        x: Of the point, frame of the part [m].
        y: As x.
        z: As x.
    """
    best, ox, oy, oz, region = triangle_offset(faces, face, x, y, z)
    moved = True
    while moved and region != _FACE:
        moved = False
        if region < 3:
            first = 9 * face + region
            last = first + 1
        else:
            first, last = links[9 * face + region], links[9 * face + region + 3]
        for k in range(first, last):
            squared, dx, dy, dz, where = triangle_offset(faces, links[k], x, y, z)
            if squared < best:
                best, ox, oy, oz, region, face = squared, dx, dy, dz, where, links[k]
                moved = True
    distance = np.sqrt(best)
    scale = 1.0 / distance if distance > 0.0 else 0.0
    return distance, ox * scale, oy * scale, oz * scale, face


@njit(cache=True, fastmath=FAST, error_model="numpy")
def triangle_offset(
    faces: FloatArray, f: int, x: float, y: float, z: float
) -> tuple[float, float, float, float, int]:
    """(x, y, z) - (nearest point of triangle f), its square, and in which region the point lies."""
    ab0, ab1, ab2 = faces[f, 3], faces[f, 4], faces[f, 5]
    ac0, ac1, ac2 = faces[f, 6], faces[f, 7], faces[f, 8]
    bb, bc, cc = faces[f, 9], faces[f, 10], faces[f, 11]
    ap0, ap1, ap2 = x - faces[f, 0], y - faces[f, 1], z - faces[f, 2]
    d1 = ab0 * ap0 + ab1 * ap1 + ab2 * ap2
    d2 = ac0 * ap0 + ac1 * ap1 + ac2 * ap2
    d3, d4 = d1 - bb, d2 - bc  # the same products seen from corner b
    d5, d6 = d1 - bc, d2 - cc  # and from corner c
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    if d1 <= 0.0 and d2 <= 0.0:
        s, t, region = 0.0, 0.0, 3
    elif d3 >= 0.0 and d4 <= d3:
        s, t, region = 1.0, 0.0, 4
    elif d6 >= 0.0 and d5 <= d6:
        s, t, region = 0.0, 1.0, 5
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        s, t, region = d1 / (d1 - d3), 0.0, 0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        s, t, region = 0.0, d2 / (d2 - d6), 1
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s, region = 1.0 - t, 2
    else:
        scale = 1.0 / (va + vb + vc)
        s, t, region = vb * scale, vc * scale, _FACE
    o0, o1, o2 = ap0 - s * ab0 - t * ac0, ap1 - s * ab1 - t * ac1, ap2 - s * ab2 - t * ac2
    return o0 * o0 + o1 * o1 + o2 * o2, o0, o1, o2, region
