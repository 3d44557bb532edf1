"""The point of a cloud nearest to a body, exactly, by cutting planes; compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.arrays import Shape, Work
from horf_env.sdf.bodies import measure, part_distance, to_body
from horf_env.sdf.fields import lipschitz_bounds
from horf_env.sdf.polytope import FAST
from horf_env.sdf.scan import CHUNK, SCAN_ERROR, place_of_least
from horf_env.sdf.shortlist import localise, place_of_lowest, shortlist
from horf_env.types import FloatArray

# A point has to promise this much less distance [m] to be measured: rounding alone does not count.
_WORTH = 1e-13


@njit(cache=True, inline="always")
def nearest_point(
    shape: Shape, work: Work, body: int, pose: FloatArray, points: FloatArray
) -> tuple[int, float, float, float, float]:
    """The nearest of the points that the scan left over.

    The point nearest to the body's box gives a first bound; only points whose box distance is below
    it are looked at further.

    Returns:
        Index of the point, -1 if the scan left none; its distance [m]; the gradient in the frame of
        the body.
    """
    minima = work.squared_minima
    chunk = place_of_least(minima.view(np.int32), 0, len(minima))
    if minima[chunk] == np.inf:
        return -1, np.inf, 0.0, 0.0, 0.0
    start = chunk * CHUNK
    chosen = place_of_least(work.squared.view(np.int32), start, start + CHUNK)
    x, y, z = to_body(pose, points, chosen)
    local = work.local
    local[0, 0], local[1, 0], local[2, 0] = x, y, z
    measure(shape, work.heights, body, local, work.lower[:1])
    least, gx, gy, gz = work.lower[0], local[0, 0], local[1, 0], local[2, 0]
    limit = (max(least, 0.0) + SCAN_ERROR) ** 2
    listed = work.listed[: shortlist(work.squared, minima, limit, work.listed)]
    localise(points, pose, listed, work.local)
    first, last = shape.body_start[body], shape.body_start[body + 1]
    nx, ny, nz = gx, gy, gz
    for part in range(first, last):
        lower = work.lower[: len(listed)]
        _part_box_distances(work.local, shape.part_boxes[part], lower)
        convex = shape.part_start[part] < shape.part_start[part + 1]
        if not convex:
            lipschitz_bounds(shape.nodes, shape.frames, part, work.local, lower)
        elif last - first == 1:
            _cut(work.local, lower, least - gx * x - gy * y - gz * z, gx, gy, gz)
        place, least, nx, ny, nz = _least_distance(shape, work, part, lower, least, nx, ny, nz)
        if place >= 0:
            chosen = listed[place]
    return chosen, least, nx, ny, nz


@njit(cache=True, inline="always")
def _least_distance(
    shape: Shape,
    work: Work,
    part: int,
    lower: FloatArray,
    least: float,
    nx: float,
    ny: float,
    nz: float,
) -> tuple[int, float, float, float, float]:
    """Place, distance and gradient of the listed point nearest to a part.

    If none is nearer than the distance given, the place is -1 and the rest is given back.

    The distance d to a convex part is convex: where it has been measured once, at s with gradient
    g, it is nowhere below d(s) + g . (p - s). So each measurement raises the lower bounds of all
    other points, and the next point measured is that with the lowest bound, until no bound is
    below the least.
    """
    nodes, near_faces, frames, boxes = shape.nodes, shape.near_faces, shape.frames, shape.part_boxes
    planes, faces, links, local = shape.planes, shape.faces, shape.links, work.local
    start, stop, heights = shape.part_start[part], shape.part_start[part + 1], work.heights
    place, convex = -1, start < stop
    while len(lower):
        m = place_of_lowest(lower)
        if lower[m] >= least - _WORTH:
            break
        x, y, z = local[0, m], local[1, m], local[2, m]
        distance, gx, gy, gz = part_distance(
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
        if distance < least:
            place, least, nx, ny, nz = m, distance, gx, gy, gz
        if convex:
            _cut(local, lower, distance - gx * x - gy * y - gz * z, gx, gy, gz)
        lower[m] = np.inf
    return place, least, nx, ny, nz


@njit(cache=True, fastmath=FAST)
def _cut(
    local: FloatArray, lower: FloatArray, offset: float, gx: float, gy: float, gz: float
) -> None:
    """Raise lower bounds to those of a supporting plane."""
    for m in range(len(lower)):
        plane = offset + gx * local[0, m] + gy * local[1, m] + gz * local[2, m]
        lower[m] = max(lower[m], plane)


@njit(cache=True, fastmath=FAST)
def _part_box_distances(local: FloatArray, box: FloatArray, lower: FloatArray) -> None:
    """Lower bounds of the distances to a part: how far its bounding box is, -inf inside it."""
    x0, y0, z0 = box[0, 0], box[0, 1], box[0, 2]
    x1, y1, z1 = box[1, 0], box[1, 1], box[1, 2]
    for m in range(len(lower)):
        ox = max(x0 - local[0, m], local[0, m] - x1, 0.0)
        oy = max(y0 - local[1, m], local[1, m] - y1, 0.0)
        oz = max(z0 - local[2, m], local[2, m] - z1, 0.0)
        square = ox * ox + oy * oy + oz * oz
        lower[m] = np.sqrt(square) if square > 0.0 else -np.inf
