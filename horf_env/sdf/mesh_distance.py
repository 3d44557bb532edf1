"""Signed distances and gradients to a mesh of any shape; libigl is needed to build fields only."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from horf_env.errors import MissingAssetError
from horf_env.robot import MeshPart
from horf_env.sdf.face_tree import face_tree, nearest_on_grid
from horf_env.types import FloatArray

_ON_SURFACE = 1e-9  # m; nearer than this the direction to the surface is noise
_FLAT = 1e-8  # m; a face that is less high has no normal, and its edges are its neighbours'


def mesh_nodes(frames: Iterable[FloatArray], mesh: MeshPart) -> list[FloatArray]:
    """Signed distance and gradient at the nodes of grids around a mesh, shape (n^3, 4) each.

    What is inside is decided by the winding number of the mesh, above one half: right for meshes
    that are open, intersect themselves or hold others. On the surface the gradient is the normal
    of the face; where several surface points are equally near, that of one of them.

    Args:
        frames: Of the grids; see `Fields`.
        mesh: The mesh, in the same frame.

    Raises:
        MissingAssetError: If libigl is not installed.
    """
    triangles = mesh.vertices[mesh.faces]
    triangles = triangles[_heights(triangles) > _FLAT]
    tree = face_tree(triangles)
    nodes = []
    for frame in frames:
        n_nodes = int(frame[9] + 1) ** 3
        offsets, nearest = np.empty((n_nodes, 3)), np.empty(n_nodes, dtype=np.int64)
        nearest_on_grid(tree, frame, offsets, nearest)
        distance = np.linalg.norm(offsets, axis=1)
        on_surface = distance < _ON_SURFACE
        distance[_inside(_places(frame), mesh)] *= -1.0
        gradient = offsets / np.where(on_surface, 1.0, distance)[:, None]
        gradient[on_surface] = _normals(triangles[nearest[on_surface]])
        nodes.append(np.column_stack([distance, gradient]))
    return nodes


def _places(frame: FloatArray) -> FloatArray:
    """Positions of the nodes of a grid, shape (n^3, 3), m."""
    steps = np.arange(int(frame[9]) + 1)
    axes = [frame[k] + steps * frame[6 + k] for k in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _inside(points: FloatArray, mesh: MeshPart) -> np.ndarray:
    """Which points are inside the mesh; none beyond its bounding box is."""
    try:
        import igl  # heavy, and no part of the installation without the extra
    except ImportError as error:
        raise MissingAssetError(
            "libigl", "fields of visual meshes are built with it; run `pip install horf[visual]`"
        ) from error
    lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    inside: np.ndarray = ((lower <= points) & (points <= upper)).all(axis=1)
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int64)
    inside[inside] = igl.fast_winding_number(mesh.vertices, faces, points[inside]) > 0.5
    return inside


def _heights(triangles: FloatArray) -> FloatArray:
    """Height of each triangle above its longest edge [m]."""
    edges = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
    doubles = np.linalg.norm(_crosses(triangles), axis=1)
    return np.divide(doubles, edges, out=np.zeros_like(edges), where=edges > 0.0)


def _normals(triangles: FloatArray) -> FloatArray:
    crosses = _crosses(triangles)
    return crosses / np.linalg.norm(crosses, axis=1, keepdims=True)


def _crosses(triangles: FloatArray) -> FloatArray:
    """Along the normals, of twice the length of the areas."""
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
