"""Grids of distances and gradients around each part of a body, near and far.

For a convex part they only say where to look; the answer is exact. Its distance d is convex, so a
node x_i with distance d_i, gradient g_i and nearest surface point s_i = x_i - d_i g_i bounds the
distance of any point p, near the grid or far from it:

    d_i + g_i . (p - x_i) <= d(p) <= |p - s_i|

Both bounds touch d at the node and are off by second order around it. Nothing is extrapolated.
For a part of any other shape the grids hold the answer itself; see `hermite`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from horf_env.robot import MeshPart
from horf_env.sdf.geometry import BodyGeometry
from horf_env.sdf.mesh_distance import mesh_nodes
from horf_env.sdf.packing import pack, unpack
from horf_env.sdf.polytope import FAST, polytope_distance
from horf_env.types import FloatArray

LEVELS = 2  # an inner grid around the part and a wider, coarser one


@dataclass(frozen=True)
class GridSize:
    """Sizes of the grids around a part: inner and outer one.

    Attributes:
        most: Nodes along each axis, at most.
        spacings: Distance of two nodes [m], mean of the axes; 0 for the most nodes.
        paddings: How far the grids reach beyond the part [m].
    """

    most: tuple[int, int]
    spacings: tuple[float, float]
    paddings: tuple[float, float]


CONVEX = GridSize((24, 24), (0.0, 0.0), (0.08, 1.0))
MESH = GridSize((64, 32), (0.0065, 0.04), (0.05, 0.5))

BOUND_ERROR = 2e-6
"""What rounding to float32 adds to the bounds [m], for points up to some 10 m away."""


@dataclass(frozen=True)
class Fields:
    """Grids of all parts, grid p * LEVELS + level for part p.

    Attributes:
        nodes: Distance [m] and its gradient, float32, shape (R, 4).
        near_faces: Face that holds the nearest point of each node of a convex part, int32; their
            rows come first, shape (<= R,).
        frames: First node [m], nodes per m, distance of two nodes [m], nodes along an axis less
            one, and first row of each grid; shape (G, 11).
    """

    nodes: np.ndarray
    near_faces: np.ndarray
    frames: FloatArray


def build_fields(geometry: BodyGeometry) -> Fields:
    """Evaluate all nodes: convex parts in about a second, meshes in half a second each.

    Raises:
        MissingAssetError: If there are meshes, and libigl is not installed.
    """
    frames = grid_frames(geometry)
    nodes = np.empty((row_count(frames), 4), dtype=np.float32)
    near_faces = np.empty(row_count(frames[~mesh_grids(geometry)]), dtype=np.int32)
    fields = Fields(nodes, near_faces, frames)
    for part, mesh in enumerate(geometry.meshes):
        if mesh is None:
            _fill_convex(fields, geometry, part)
        else:
            _fill_mesh(fields, mesh, part)
    return fields


def _fill_convex(fields: Fields, geometry: BodyGeometry, part: int) -> None:
    g = geometry
    heights = np.empty(len(g.faces))
    start, stop = g.part_start[part : part + 2]
    for frame in fields.frames[part * LEVELS : (part + 1) * LEVELS]:
        rows = grid_rows(frame)
        nodes, near_faces = fields.nodes[rows], fields.near_faces[rows]
        _fill(nodes, near_faces, frame, g.planes, g.faces, g.links, heights, start, stop)


def _fill_mesh(fields: Fields, mesh: MeshPart, part: int) -> None:
    frames = fields.frames[part * LEVELS : (part + 1) * LEVELS]
    for frame, nodes in zip(frames, mesh_nodes(frames, mesh), strict=True):
        unpack(*pack(nodes), fields.nodes[grid_rows(frame)])  # rounded, as they are read back


def grid_frames(geometry: BodyGeometry) -> FloatArray:
    """Frames of all grids; see `Fields`."""
    is_mesh = mesh_grids(geometry)
    frames = np.empty((len(is_mesh), 11))
    row = 0
    for grid in np.argsort(is_mesh, kind="stable"):
        part, level = divmod(grid, LEVELS)
        size = MESH if is_mesh[grid] else CONVEX
        lower = geometry.part_boxes[part, 0] - size.paddings[level]
        upper = geometry.part_boxes[part, 1] + size.paddings[level]
        n = _nodes_along(upper - lower, size.spacings[level], size.most[level])
        cell = (upper - lower) / (n - 1)
        frames[grid] = *lower, *(1.0 / cell), *cell, n - 1, row
        row += n**3
    return frames


def mesh_grids(geometry: BodyGeometry) -> np.ndarray:
    """Which grids are around a mesh of any shape, shape (G,)."""
    return np.repeat([isinstance(mesh, MeshPart) for mesh in geometry.meshes], LEVELS)


def _nodes_along(extents: FloatArray, spacing: float, most: int) -> int:
    if spacing == 0.0:
        return most
    return min(int(np.ceil(np.cbrt(extents.prod()) / spacing)) + 1, most)


def grid_rows(frame: FloatArray) -> slice:
    """Rows of the nodes of a grid."""
    return slice(int(frame[10]), int(frame[10] + (frame[9] + 1) ** 3))


def row_count(frames: FloatArray) -> int:
    """Nodes of all grids together."""
    return int(((frames[:, 9] + 1) ** 3).sum())


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
    n, row = int(frame[9]) + 1, 0
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
    """Lower and upper bound of the distance of a point to a convex part [m], and the node's row."""
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

    For a part that is not convex it is no bound but an estimate.

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


@njit(cache=True, fastmath=FAST, error_model="numpy")
def lipschitz_bounds(
    nodes: np.ndarray, frames: FloatArray, part: int, local: FloatArray, lower: FloatArray
) -> None:
    """Raise each number to what the nearest node guarantees: no distance changes faster than 1.

    Args:
        nodes: See `Fields`.
        frames: See `Fields`.
        part: Index of the part, of any shape.
        local: Points in the frame of the body, shape (3, >= N), m.
        lower: Read and written, shape (N,), m.
    """
    for m in range(len(lower)):
        row, dx, dy, dz = _node_near(frames, part, local[0, m], local[1, m], local[2, m])
        away = np.sqrt(dx * dx + dy * dy + dz * dz)
        lower[m] = max(lower[m], nodes[row, 0] - away - BOUND_ERROR)


@njit(cache=True, fastmath=FAST, inline="always")
def _node_near(
    frames: FloatArray, part: int, x: float, y: float, z: float
) -> tuple[int, float, float, float]:
    """Row of the node nearest to a point, and the point relative to that node [m]."""
    g = part * LEVELS
    top = frames[g, 9]
    u = (x - frames[g, 0]) * frames[g, 3]
    v = (y - frames[g, 1]) * frames[g, 4]
    w = (z - frames[g, 2]) * frames[g, 5]
    if min(u, min(v, w)) < 0.0 or max(u, max(v, w)) > top:
        g += 1
        top = frames[g, 9]
        u = (x - frames[g, 0]) * frames[g, 3]
        v = (y - frames[g, 1]) * frames[g, 4]
        w = (z - frames[g, 2]) * frames[g, 5]
    i = int(min(max(u, 0.0), top) + 0.5)
    j = int(min(max(v, 0.0), top) + 0.5)
    k = int(min(max(w, 0.0), top) + 0.5)
    n = int(top) + 1
    row = int(frames[g, 10]) + (i * n + j) * n + k
    return row, (u - i) * frames[g, 6], (v - j) * frames[g, 7], (w - k) * frames[g, 8]
