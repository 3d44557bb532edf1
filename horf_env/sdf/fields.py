"""Grids of exact distances and gradients around each convex part: a filter, never the answer.

The distance d to a convex part is convex. So a node x_i with distance d_i, gradient g_i and nearest
surface point s_i = x_i - d_i g_i bounds the distance of any point p, near the grid or far from it:

    d_i + g_i . (p - x_i) <= d(p) <= |p - s_i|

Both bounds touch d at the node and are off by second order around it. Nothing is extrapolated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from horf_env.sdf.geometry import BodyGeometry
from horf_env.sdf.polytope import FAST, polytope_distance
from horf_env.types import FloatArray

RESOLUTION = 24  # nodes along each axis of a grid
PADDINGS = (0.08, 1.0)  # m around the part, inner and outer grid
LEVELS = len(PADDINGS)
BOUND_ERROR = 2e-6
"""What rounding to float32 adds to the bounds [m], for points up to some 10 m away."""


@dataclass(frozen=True)
class Fields:
    """Grids of all parts, grid p * LEVELS + level for part p.

    Attributes:
        nodes: Distance [m] and its gradient, float32, shape (G * n^3, 4).
        near_faces: Face that holds the nearest point of each node, int32, shape (G * n^3,).
        frames: First node [m], nodes per m, and distance of two nodes [m] of each grid, (G, 9).
    """

    nodes: np.ndarray
    near_faces: np.ndarray
    frames: FloatArray


def build_fields(geometry: BodyGeometry) -> Fields:
    """Evaluate the exact distance at all nodes (less than a second on one core)."""
    n_grids = (len(geometry.part_start) - 1) * LEVELS
    frames = np.empty((n_grids, 9))
    nodes = np.empty((n_grids, RESOLUTION**3, 4), dtype=np.float32)
    near_faces = np.empty((n_grids, RESOLUTION**3), dtype=np.int32)
    heights = np.empty(len(geometry.faces))
    for grid in range(n_grids):
        part, level = divmod(grid, LEVELS)
        corners = geometry.corners(part).reshape(-1, 3)
        lower, upper = corners.min(axis=0) - PADDINGS[level], corners.max(axis=0) + PADDINGS[level]
        cell = (upper - lower) / (RESOLUTION - 1)
        frames[grid] = *lower, *(1.0 / cell), *cell
        start, stop = geometry.part_start[part : part + 2]
        g = geometry
        _fill(
            nodes[grid],
            near_faces[grid],
            frames[grid],
            g.planes,
            g.faces,
            g.links,
            heights,
            start,
            stop,
        )
    return Fields(nodes.reshape(-1, 4), near_faces.ravel(), frames)


@njit(cache=True)
def _fill(
    nodes: np.ndarray,
    near_faces: np.ndarray,
    frame: FloatArray,
    planes: FloatArray,
    faces: FloatArray,
    links: np.ndarray,
    heights: FloatArray,
    start: int,
    stop: int,
) -> None:
    n, row = RESOLUTION, 0
    for i in range(n):
        x = frame[0] + i * frame[6]
        for j in range(n):
            y = frame[1] + j * frame[7]
            for k in range(n):
                z = frame[2] + k * frame[8]
                distance, nx, ny, nz, face = polytope_distance(
                    planes, faces, links, heights, start, stop, x, y, z
                )
                nodes[row, 0] = distance
                nodes[row, 1], nodes[row, 2], nodes[row, 3] = nx, ny, nz
                near_faces[row] = face
                row += 1


@njit(cache=True, fastmath=FAST, error_model="numpy")
def bounds(
    nodes: np.ndarray, frames: FloatArray, part: int, x: float, y: float, z: float
) -> tuple[float, float, int]:
    """Lower and upper bound of the distance of a point to a part [m], and the node's row."""
    row, dx, dy, dz = _node_near(frames, part, x, y, z)
    distance = nodes[row, 0]
    along = nodes[row, 1] * dx + nodes[row, 2] * dy + nodes[row, 3] * dz
    squared = dx * dx + dy * dy + dz * dz
    if distance > 0.0:
        upper = np.sqrt(distance * distance + 2.0 * distance * along + squared)
    else:
        upper = distance + np.sqrt(squared)
    return distance + along - BOUND_ERROR, upper + BOUND_ERROR, row


@njit(cache=True, fastmath=FAST, error_model="numpy")
def lower_bounds(
    nodes: np.ndarray, frames: FloatArray, part: int, local: FloatArray, lower: FloatArray
) -> None:
    """Lower each number to the lower bound of a point's distance to a part, if that is less.

    Args:
        nodes: See `Fields`.
        frames: See `Fields`.
        part: Index of the part.
        local: Points in the frame of the body, shape (3, >= N), m.
        lower: Read and written, shape (N,), m.
    """
    for m in range(len(lower)):
        row, dx, dy, dz = _node_near(frames, part, local[0, m], local[1, m], local[2, m])
        along = nodes[row, 1] * dx + nodes[row, 2] * dy + nodes[row, 3] * dz
        lower[m] = min(lower[m], nodes[row, 0] + along - BOUND_ERROR)


@njit(cache=True, fastmath=FAST, inline="always")
def _node_near(
    frames: FloatArray, part: int, x: float, y: float, z: float
) -> tuple[int, float, float, float]:
    """Row of the node nearest to a point, and the point relative to that node [m]."""
    n, g = RESOLUTION, part * LEVELS
    u = (x - frames[g, 0]) * frames[g, 3]
    v = (y - frames[g, 1]) * frames[g, 4]
    w = (z - frames[g, 2]) * frames[g, 5]
    if min(u, min(v, w)) < 0.0 or max(u, max(v, w)) > n - 1.0:
        g += 1
        u = (x - frames[g, 0]) * frames[g, 3]
        v = (y - frames[g, 1]) * frames[g, 4]
        w = (z - frames[g, 2]) * frames[g, 5]
    i = int(min(max(u, 0.0), n - 1.0) + 0.5)
    j = int(min(max(v, 0.0), n - 1.0) + 0.5)
    k = int(min(max(w, 0.0), n - 1.0) + 0.5)
    row = ((g * n + i) * n + j) * n + k
    return row, (u - i) * frames[g, 6], (v - j) * frames[g, 7], (w - k) * frames[g, 8]
