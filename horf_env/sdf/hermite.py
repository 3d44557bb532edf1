"""Distance to a part of any shape from its grids, compiled.

Hermite interpolation: trilinear, and along each axis of the cell the cubic that meets distances and
slopes at its ends (Adini's element). It is exact for polynomials of third degree, continuous, and
its derivative is known in closed form. A corner that is p, q and r cells away along the axes, with
its trilinear weight w, adds w times its prediction

    d (1 + c(p) + c(q) + c(r)) + nx p (1 - p) + ny q (1 - q) + nz r (1 - r),  c(p) = p (1 - 2 p)

where n is the gradient at the corner a cell, towards the inside of the cell.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.fields import LEVELS
from horf_env.sdf.polytope import FAST
from horf_env.types import FloatArray


@njit(cache=True)
def field_distance(
    nodes: np.ndarray,
    frames: FloatArray,
    boxes: FloatArray,
    part: int,
    x: float,
    y: float,
    z: float,
) -> tuple[float, float, float, float]:
    """Distance of a point to a part [m] and the gradient of the interpolated field.

    Grids are never extrapolated. Beyond the outer grid the answer is the distance from the bounding
    box of the part, which is never more than the true one.

    Args:
        nodes: See `Fields`.
        frames: See `Fields`.
        boxes: Bounding boxes of the parts, shape (P, 2, 3), m.
        part: Index of the part.
        x: Of the point, frame of the part [m].
        y: As x.
        z: As x.
    """
    for g in range(part * LEVELS, (part + 1) * LEVELS):
        top = frames[g, 9]
        u = (x - frames[g, 0]) * frames[g, 3]
        v = (y - frames[g, 1]) * frames[g, 4]
        w = (z - frames[g, 2]) * frames[g, 5]
        if min(u, min(v, w)) >= 0.0 and max(u, max(v, w)) <= top:
            return _interpolated(nodes, frames, g, u, v, w)
    ox = x - min(max(x, boxes[part, 0, 0]), boxes[part, 1, 0])
    oy = y - min(max(y, boxes[part, 0, 1]), boxes[part, 1, 1])
    oz = z - min(max(z, boxes[part, 0, 2]), boxes[part, 1, 2])
    distance = np.sqrt(ox * ox + oy * oy + oz * oz)
    return distance, ox / distance, oy / distance, oz / distance


@njit(cache=True, fastmath=FAST)
def _interpolated(
    nodes: np.ndarray, frames: FloatArray, g: int, u: float, v: float, w: float
) -> tuple[float, float, float, float]:
    """Value and gradient at grid coordinates (u, v, w) within grid g."""
    top = int(frames[g, 9])
    i, j, k = min(int(u), top - 1), min(int(v), top - 1), min(int(w), top - 1)
    first = int(frames[g, 10])
    hx, hy, hz = frames[g, 6], frames[g, 7], frames[g, 8]
    value, gx, gy, gz = 0.0, 0.0, 0.0, 0.0
    for corner in range(8):
        a, b, c = corner >> 2, (corner >> 1) & 1, corner & 1
        row = first + ((i + a) * (top + 1) + j + b) * (top + 1) + k + c
        sx, sy, sz = 1.0 - 2 * a, 1.0 - 2 * b, 1.0 - 2 * c  # from the corner into the cell
        p, q, r = sx * (u - i - a), sy * (v - j - b), sz * (w - k - c)  # how far, in cells
        wx, wy, wz = 1.0 - p, 1.0 - q, 1.0 - r
        d = nodes[row, 0]
        nx, ny, nz = sx * hx * nodes[row, 1], sy * hy * nodes[row, 2], sz * hz * nodes[row, 3]
        prediction = d * (1.0 + p * (1.0 - 2.0 * p) + q * (1.0 - 2.0 * q) + r * (1.0 - 2.0 * r))
        prediction += nx * p * wx + ny * q * wy + nz * r * wz
        weight = wx * wy * wz
        value += weight * prediction
        gx += sx * (weight * (d * (1.0 - 4.0 * p) + nx * (wx - p)) - wy * wz * prediction)
        gy += sy * (weight * (d * (1.0 - 4.0 * q) + ny * (wy - q)) - wx * wz * prediction)
        gz += sz * (weight * (d * (1.0 - 4.0 * r) + nz * (wz - r)) - wx * wy * prediction)
    return value, gx * frames[g, 3], gy * frames[g, 4], gz * frames[g, 5]
