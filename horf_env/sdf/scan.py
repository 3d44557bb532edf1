"""First pass over a cloud: how far each point is from a body's bounding box, in vector code.

Single precision with the coordinates apart, without branches and calls. The pass only sorts out
points that cannot matter; what is left is evaluated in double precision from the original points.
"""

from __future__ import annotations

import numpy as np
from numba import config, njit

from horf_env.sdf.polytope import FAST
from horf_env.types import FloatArray

# Without it numba leaves the minima of a chunk in scalar code.
config.SLP_VECTORIZE = 1

CHUNK = 64
"""Points that share one minimum."""
SCAN_ERROR = 5e-6
"""What single precision adds to a distance [m], for points up to some 10 m from the robot."""

_MAGNITUDE = np.int32(0x7FFFFFFF)  # all bits but the sign
_INFINITY = 0x7F800000  # bits of float32 inf

_f4 = np.float32


@njit(cache=True)
def load(points: FloatArray, origin: FloatArray, cloud: np.ndarray) -> bool:
    """Copy points (N, 3) relative to an origin to coordinates apart (3, >= N) in float32.

    Returns:
        Whether all numbers are finite.
    """
    n, x, y, z = len(points), origin[0], origin[1], origin[2]
    for i in range(n):
        cloud[0, i] = points[i, 0] - x
        cloud[1, i] = points[i, 1] - y
        cloud[2, i] = points[i, 2] - z
    highest = 0
    for j in range(3):
        highest = max(highest, _highest_magnitude(cloud[j, :n].view(np.int32)))
    return highest < _INFINITY


@njit(cache=True)
def _highest_magnitude(bits: np.ndarray) -> int:
    """Greatest of the bits of float32 numbers without their signs; it has the order of the sizes.

    NaN and inf have the greatest of all, and comparing bits compiles to vector code.
    """
    highest = np.int32(0)
    for i in range(len(bits)):
        highest = max(highest, bits[i] & _MAGNITUDE)
    return int(highest)


@njit(cache=True, fastmath=FAST)
def _beyond(x: float, lower: float, upper: float) -> float:
    """Signed distance of a coordinate from an interval, 0 inside."""
    return x - min(max(x, lower), upper)


@njit(cache=True, fastmath=FAST)
def box_distances(
    cloud: np.ndarray,
    n: int,
    pose: FloatArray,
    box: FloatArray,
    cutoff: float,
    squared: np.ndarray,
) -> None:
    """Squared distance of each point from the box of a body; inf beyond the cut-off.

    Args:
        cloud: Points relative to some origin, shape (3, >= N), m.
        n: Number of points, N; places after them get inf.
        pose: Of the body, relative to the same origin, shape (4, 4).
        box: Lower and upper corner in the frame of the body, shape (2, 3), m.
        cutoff: Distance from the box [m].
        squared: Written, shape (>= N,), m^2.
    """
    r00, r01, r02, t0 = _f4(pose[0, 0]), _f4(pose[0, 1]), _f4(pose[0, 2]), _f4(pose[0, 3])
    r10, r11, r12, t1 = _f4(pose[1, 0]), _f4(pose[1, 1]), _f4(pose[1, 2]), _f4(pose[1, 3])
    r20, r21, r22, t2 = _f4(pose[2, 0]), _f4(pose[2, 1]), _f4(pose[2, 2]), _f4(pose[2, 3])
    x0, y0, z0 = _f4(box[0, 0]), _f4(box[0, 1]), _f4(box[0, 2])
    x1, y1, z1 = _f4(box[1, 0]), _f4(box[1, 1]), _f4(box[1, 2])
    limit, none = _f4(cutoff * cutoff), _f4(np.inf)
    for i in range(n):
        dx, dy, dz = cloud[0, i] - t0, cloud[1, i] - t1, cloud[2, i] - t2
        ox = _beyond(r00 * dx + r10 * dy + r20 * dz, x0, x1)
        oy = _beyond(r01 * dx + r11 * dy + r21 * dz, y0, y1)
        oz = _beyond(r02 * dx + r12 * dy + r22 * dz, z0, z1)
        value = ox * ox + oy * oy + oz * oz
        squared[i] = value if value <= limit else none
    squared[n:] = none


@njit(cache=True, fastmath=FAST)
def braking_distances(
    cloud: np.ndarray,
    n: int,
    pose: FloatArray,
    box: FloatArray,
    twist: FloatArray,
    braking: float,
    shift: float,
    cutoff: float,
    squared: np.ndarray,
    keys: np.ndarray,
) -> None:
    """As `box_distances`, and what is left of the distance once the body has braked.

    Args:
        cloud: As above.
        n: As above.
        pose: As above.
        box: As above.
        twist: Velocity of the body (linear; angular) in its own frame, shape (6,).
        braking: Deceleration [m/s^2].
        shift: Added to the keys, so that none is negative [m].
        cutoff: Points that keep more than this are out: both numbers become inf [m].
        squared: As above.
        keys: Written: distance from the box less the way towards the point while braking, plus the
            shift; shape (>= N,), m.
    """
    r00, r01, r02, t0 = _f4(pose[0, 0]), _f4(pose[0, 1]), _f4(pose[0, 2]), _f4(pose[0, 3])
    r10, r11, r12, t1 = _f4(pose[1, 0]), _f4(pose[1, 1]), _f4(pose[1, 2]), _f4(pose[1, 3])
    r20, r21, r22, t2 = _f4(pose[2, 0]), _f4(pose[2, 1]), _f4(pose[2, 2]), _f4(pose[2, 3])
    x0, y0, z0 = _f4(box[0, 0]), _f4(box[0, 1]), _f4(box[0, 2])
    x1, y1, z1 = _f4(box[1, 0]), _f4(box[1, 1]), _f4(box[1, 2])
    v0, v1, v2 = _f4(twist[0]), _f4(twist[1]), _f4(twist[2])
    w0, w1, w2 = _f4(twist[3]), _f4(twist[4]), _f4(twist[5])
    per_speed, offset, limit = _f4(0.5 / braking), _f4(shift), _f4(cutoff + shift)
    zero, tiny, none = _f4(0.0), _f4(1e-12), _f4(np.inf)
    for i in range(n):
        dx, dy, dz = cloud[0, i] - t0, cloud[1, i] - t1, cloud[2, i] - t2
        x = r00 * dx + r10 * dy + r20 * dz
        y = r01 * dx + r11 * dy + r21 * dz
        z = r02 * dx + r12 * dy + r22 * dz
        ox, oy, oz = _beyond(x, x0, x1), _beyond(y, y0, y1), _beyond(z, z0, z1)
        value = ox * ox + oy * oy + oz * oz
        # Speed towards the point times the distance from it.
        towards = max(
            (v0 + w1 * z - w2 * y) * ox + (v1 + w2 * x - w0 * z) * oy + (v2 + w0 * y - w1 * x) * oz,
            zero,
        )
        key = np.sqrt(value) - per_speed * towards * towards / max(value, tiny) + offset
        keys[i] = key if key <= limit else none
        squared[i] = value if key <= limit else none
    keys[n:] = none
    squared[n:] = none


@njit(cache=True, fastmath=FAST)
def distances(squared: np.ndarray, keys: np.ndarray) -> None:
    """Keys of a body at rest: distances from its box [m]."""
    for i in range(len(squared)):
        keys[i] = np.sqrt(squared[i])


@njit(cache=True, fastmath=FAST)
def chunk_minima(values: np.ndarray, minima: np.ndarray) -> None:
    """Least of each chunk of non-negative float32 numbers, taken on their bits as integers.

    Integers of non-negative floats have the same order, and their minimum compiles to vector code.

    Args:
        values: int32 view, shape (M * CHUNK,).
        minima: Written: int32 view, shape (M,).
    """
    for c in range(len(minima)):
        least = values[c * CHUNK]
        for i in range(c * CHUNK, (c + 1) * CHUNK):
            least = min(least, values[i])
        minima[c] = least


@njit(cache=True, fastmath=FAST)
def place_of_least(values: np.ndarray, start: int, stop: int) -> int:
    """Index of the least of values[start:stop] (int32)."""
    least = values[start]
    for i in range(start, stop):
        least = min(least, values[i])
    place = start
    while values[place] != least:
        place += 1
    return place
