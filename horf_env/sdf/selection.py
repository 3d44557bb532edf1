"""Choice of several witness points of a body, most critical first and well apart, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.arrays import Shape, Work
from horf_env.sdf.bodies import to_body
from horf_env.sdf.fields import lower_bounds
from horf_env.sdf.polytope import FAST
from horf_env.sdf.scan import chunk_minima, place_of_least
from horf_env.sdf.shortlist import localise, place_of_lowest, shortlist
from horf_env.types import FloatArray, IntArray

# The first list holds the points whose key is at most this much above the least [m], each further
# one reaches farther: short lists, since points near a chosen one are struck out before the next.
_FIRST_REACH = 0.05
_GROWTH = 1.6


@njit(cache=True, inline="always")
def further_witnesses(
    shape: Shape,
    work: Work,
    body: int,
    pose: FloatArray,
    points: FloatArray,
    spacing: float,
    chosen: IntArray,
) -> int:
    """Fill the places after the first with points in the order of their keys.

    The keys of the scan hold the distance from the bounding box. Points with low keys are listed
    and their keys raised to what the fields say; a point is chosen if its raised key is no higher
    than the keys of all points that are not listed.

    Args:
        shape: The bodies.
        work: The scan of this body, with keys.
        body: Index of the body.
        pose: T_world_body, shape (4, 4).
        points: Cloud in the world, shape (N, 3), m.
        spacing: Least distance between two chosen points [m].
        chosen: Indices, shape (K,); the first is given, the others are written.

    Returns:
        How many were chosen, the first included.
    """
    minima = work.key_minima
    chunk_minima(work.keys.view(np.int32), minima.view(np.int32))
    least = minima[place_of_least(minima.view(np.int32), 0, len(minima))]
    reach, count, complete = _FIRST_REACH, 1, False
    while count < len(chosen) and not complete:
        n = shortlist(work.keys, minima, least + reach, work.listed)
        complete = reach > _FIRST_REACH and n == _count_finite(work.keys)
        localise(points, pose, work.listed[:n], work.local)
        n = _survivors(work, pose, points, chosen[:count], spacing, n)
        listed, keys = work.listed[:n], work.lower[:n]
        _raise_keys(shape, work, body, listed, keys)
        limit = np.inf if complete else least + reach
        count = _choose(work.local, listed, keys, spacing, limit, chosen, count)
        reach *= _GROWTH
    return count


@njit(cache=True)
def _count_finite(keys: np.ndarray) -> int:
    count = 0
    for i in range(len(keys)):
        count += keys[i] < np.inf
    return count


@njit(cache=True, inline="always")
def _survivors(
    work: Work,
    pose: FloatArray,
    points: FloatArray,
    chosen: IntArray,
    spacing: float,
    n: int,
) -> int:
    """Drop listed points that are too close to a chosen one, from now on; return how many stay."""
    listed, local, marks = work.listed, work.local, work.lower[:n]
    marks[:] = 0.0
    for k in range(len(chosen)):
        x, y, z = to_body(pose, points, chosen[k])
        _strike_out(local, marks, x, y, z, spacing)
    kept = 0
    for m in range(n):
        if marks[m] > 0.0:
            work.keys[listed[m]] = np.inf
            continue
        listed[kept] = listed[m]
        local[0, kept], local[1, kept], local[2, kept] = local[0, m], local[1, m], local[2, m]
        kept += 1
    return kept


@njit(cache=True, inline="always")
def _raise_keys(shape: Shape, work: Work, body: int, listed: IntArray, keys: FloatArray) -> None:
    """Keys of the listed points with the lower bound of the fields instead of the box distance."""
    keys[:] = np.inf
    for part in range(shape.body_start[body], shape.body_start[body + 1]):
        lower_bounds(shape.nodes, shape.frames, part, work.local, keys)
    for m in range(len(listed)):
        i = listed[m]
        keys[m] = work.keys[i] + max(keys[m] - np.sqrt(work.squared[i]), 0.0)


@njit(cache=True, inline="always")
def _choose(
    local: FloatArray,
    listed: IntArray,
    keys: FloatArray,
    spacing: float,
    limit: float,
    chosen: IntArray,
    count: int,
) -> int:
    """Take the lowest keys up to a limit, one after the other; return how many are chosen."""
    while count < len(chosen) and len(listed):
        m = place_of_lowest(keys)
        if keys[m] == np.inf or keys[m] > limit:
            break
        chosen[count] = listed[m]
        count += 1
        _strike_out(local, keys, local[0, m], local[1, m], local[2, m], spacing)
    return count


@njit(cache=True, fastmath=FAST)
def _strike_out(
    local: FloatArray, keys: FloatArray, x: float, y: float, z: float, spacing: float
) -> None:
    """Set the keys of points within the spacing around a centre, itself included, to inf."""
    square = spacing * spacing
    for m in range(len(keys)):
        dx, dy, dz = local[0, m] - x, local[1, m] - y, local[2, m] - z
        keys[m] = np.inf if dx * dx + dy * dy + dz * dz <= square else keys[m]
