"""Parts of all bodies as flat arrays for the compiled kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from horf_env.robot import MeshPart, Part
from horf_env.types import FloatArray, IntArray

_NO_FACES = np.empty((0, 3), dtype=np.int64)


@dataclass(frozen=True)
class BodyGeometry:
    """All faces of all convex parts, part after part, in body frames [m].

    Attributes:
        planes: Outward unit normal and offset of each face, n.x = offset; shape (4, F).
        faces: Corner a, edges ab and ac, and the products ab.ab, ab.ac, ac.ac; shape (F, 12).
        links: For each face nine numbers: the faces across the edges ab, ac and bc; where the lists
            of the faces around a, b and c begin in this array; where they end. Then those lists.
        part_start: First face of each part and the end, shape (P + 1,). A part of any other shape
            has no faces here.
        body_start: First part of each body and the end, shape (B + 1,).
        boxes: Lower and upper corner of each body's bounding box, shape (B, 2, 3).
        part_boxes: The same of each part, shape (P, 2, 3).
        vertices: Corners of all parts, body after body, shape (V, 3).
        vertex_start: First corner of each body and the end, shape (B + 1,).
        meshes: For each part its mesh, None for a convex one.
    """

    planes: FloatArray
    faces: FloatArray
    links: np.ndarray
    part_start: IntArray
    body_start: IntArray
    boxes: FloatArray
    part_boxes: FloatArray
    vertices: FloatArray
    vertex_start: IntArray
    meshes: tuple[MeshPart | None, ...]


def body_geometry(bodies: Sequence[Sequence[Part]]) -> BodyGeometry:
    """Flatten the parts of the bodies."""
    parts = [part for body in bodies for part in body]
    meshes = tuple(part if isinstance(part, MeshPart) else None for part in parts)
    faces = [_NO_FACES if isinstance(part, MeshPart) else part.faces for part in parts]
    triangles = np.concatenate([p.vertices[f] for p, f in zip(parts, faces, strict=True)])
    first = _starts([len(part.vertices) for part in parts])
    indices = np.concatenate([f + k for f, k in zip(faces, first[:-1], strict=True)])
    vertices = [np.concatenate([part.vertices for part in body]) for body in bodies]
    return BodyGeometry(
        planes=_planes(triangles),
        faces=face_rows(triangles),
        links=_links(indices),
        part_start=_starts([len(f) for f in faces]),
        body_start=_starts([len(body) for body in bodies]),
        boxes=_boxes(vertices),
        part_boxes=_boxes([part.vertices for part in parts]),
        vertices=np.concatenate(vertices),
        vertex_start=_starts([len(v) for v in vertices]),
        meshes=meshes,
    )


def _starts(lengths: Sequence[int]) -> IntArray:
    return np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)


def _boxes(groups: Sequence[FloatArray]) -> FloatArray:
    return np.array([[v.min(axis=0), v.max(axis=0)] for v in groups])


def _planes(triangles: FloatArray) -> FloatArray:
    edges = triangles[:, 1:] - triangles[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    offsets = np.einsum("fi,fi->f", normals, triangles[:, 0])
    return np.ascontiguousarray(np.column_stack([normals, offsets]).T)


def face_rows(triangles: FloatArray) -> FloatArray:
    """What distances to triangles (F, 3, 3) are computed from; see `BodyGeometry.faces`."""
    a, b, c = triangles.transpose(1, 0, 2)
    ab, ac = b - a, c - a
    products = [np.einsum("fi,fi->f", u, v) for u, v in ((ab, ab), (ab, ac), (ac, ac))]
    return np.column_stack([a, ab, ac, *products])


def _links(indices: np.ndarray) -> np.ndarray:
    """Neighbours of each face across its edges and around its corners; see `BodyGeometry`."""
    n_faces = len(indices)
    links = np.empty((n_faces, 9), dtype=np.int32)
    links[:, :3] = _across_edges(indices)
    order = np.argsort(indices.ravel(), kind="stable")
    start = 9 * n_faces + _starts(np.bincount(indices.ravel()).tolist())
    links[:, 3:6], links[:, 6:9] = start[indices], start[indices + 1]
    return np.concatenate([links.ravel(), (order // 3).astype(np.int32)])


def _across_edges(indices: np.ndarray) -> np.ndarray:
    """Face on the other side of the edges ab, ac and bc of each face, shape (F, 3)."""
    edges = np.sort(indices[:, [[0, 1], [0, 2], [1, 2]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)  # a closed surface: each edge twice, now side by side
    across = np.empty(len(edges), dtype=np.int32)
    across[order[0::2]], across[order[1::2]] = order[1::2] // 3, order[0::2] // 3
    return across.reshape(-1, 3)
