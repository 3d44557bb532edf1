"""Signed distances and gradients to a mesh of any shape, by libigl; needed to build fields only."""

from __future__ import annotations

import numpy as np

from horf_env.errors import MissingAssetError
from horf_env.robot import MeshPart
from horf_env.types import FloatArray

_ON_SURFACE = 1e-9  # m; nearer than this the direction to the surface is noise


def mesh_nodes(points: FloatArray, mesh: MeshPart) -> np.ndarray:
    """Signed distance and gradient at points, float32, shape (N, 4).

    What is inside is decided by the winding number of the mesh, above one half: right for meshes
    that are open, intersect themselves or hold others. On the surface the gradient is the normal
    of the face; where several surface points are equally near, that of one of them.

    Args:
        points: Shape (N, 3), frame of the mesh, m.
        mesh: The mesh.

    Raises:
        MissingAssetError: If libigl is not installed.
    """
    try:
        import igl  # heavy, and no part of the installation without the extra
    except ImportError as error:
        raise MissingAssetError(
            "libigl", "fields of visual meshes are built with it; run `pip install horf[visual]`"
        ) from error
    faces = np.ascontiguousarray(mesh.faces, dtype=np.int64)
    squared, face, nearest = igl.point_mesh_squared_distance(points, mesh.vertices, faces)
    inside = igl.fast_winding_number(mesh.vertices, faces, points) > 0.5
    distance = np.where(inside, -1.0, 1.0) * np.sqrt(squared)
    on_surface = np.abs(distance) < _ON_SURFACE
    gradient = (points - nearest) / np.where(on_surface, 1.0, distance)[:, None]
    corners = mesh.vertices[faces[face[on_surface]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    gradient[on_surface] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return np.column_stack([distance, gradient]).astype(np.float32)
