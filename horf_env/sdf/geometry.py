"""Convex parts of the nine bodies as flat arrays for the compiled kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from horf_env.robot import ConvexPart
from horf_env.types import FloatArray, IntArray


@dataclass(frozen=True)
class BodyGeometry:
    """All triangles of all parts, part after part, in body frames [m].

    Attributes:
        planes: Outward unit normal and offset of each triangle, n.x = offset; shape (F, 4).
        triangles: Corners, shape (F, 3, 3).
        spheres: Centre and radius of a ball around each triangle, shape (F, 4).
        part_start: First triangle of each part and the end, shape (P + 1,).
        body_start: First part of each body and the end, shape (B + 1,).
        boxes: Lower and upper corner of each body's bounding box, shape (B, 2, 3).
        vertices: Corners of all parts of each body, B arrays (V, 3).
    """

    planes: FloatArray
    triangles: FloatArray
    spheres: FloatArray
    part_start: IntArray
    body_start: IntArray
    boxes: FloatArray
    vertices: tuple[FloatArray, ...]


def body_geometry(bodies: Sequence[Sequence[ConvexPart]]) -> BodyGeometry:
    """Flatten the parts of the bodies."""
    parts = [part for body in bodies for part in body]
    triangles = np.concatenate([part.vertices[part.faces] for part in parts])
    vertices = tuple(np.concatenate([part.vertices for part in body]) for body in bodies)
    return BodyGeometry(
        planes=_planes(triangles),
        triangles=triangles,
        spheres=_bounding_spheres(triangles),
        part_start=_starts([len(part.faces) for part in parts]),
        body_start=_starts([len(body) for body in bodies]),
        boxes=np.array([[v.min(axis=0), v.max(axis=0)] for v in vertices]),
        vertices=vertices,
    )


def _starts(lengths: Sequence[int]) -> IntArray:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _planes(triangles: FloatArray) -> FloatArray:
    edges = triangles[:, 1:] - triangles[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = np.einsum("fi,fi->f", normals, triangles[:, 0])
    return np.column_stack([normals, offsets])


def _bounding_spheres(triangles: FloatArray) -> FloatArray:
    centres = triangles.mean(axis=1)
    radii = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
    return np.column_stack([centres, radii])
