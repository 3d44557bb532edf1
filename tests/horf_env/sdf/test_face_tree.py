"""Nearest faces against libigl's brute force."""

import igl
import numpy as np
import pytest
import trimesh

from horf_env.robot import MeshPart, visual_parts
from horf_env.sdf.face_tree import face_tree, nearest_on_grid
from horf_env.sdf.fields import grid_frames
from horf_env.sdf.geometry import body_geometry
from horf_env.sdf.mesh_distance import mesh_nodes

HAND = visual_parts()[8][0]


def nearest(mesh, frame):
    count = int(frame[9] + 1) ** 3
    offsets, faces = np.empty((count, 3)), np.empty(count, dtype=np.int64)
    nearest_on_grid(face_tree(mesh.vertices[mesh.faces]), frame, offsets, faces)
    return offsets, faces


@pytest.mark.parametrize("n_faces", [1, 2, 15, 16, 17, 1000, len(HAND.faces)])
def test_offsets_are_those_of_brute_force(n_faces):
    mesh = MeshPart(HAND.vertices, HAND.faces[:n_faces])
    used = MeshPart(mesh.vertices[np.unique(mesh.faces)], mesh.faces)
    lower, cell = used.vertices.min(axis=0) - 0.04, (np.ptp(used.vertices, axis=0) + 0.08) / 11
    offsets, _ = nearest(mesh, np.array([*lower, *(1 / cell), *cell, 11, 0]))
    steps = np.stack(np.meshgrid(*3 * [np.arange(12)], indexing="ij"), axis=-1).reshape(-1, 3)
    squared, _, _ = igl.point_mesh_squared_distance(
        lower + steps * cell, mesh.vertices, mesh.faces.astype(np.int64)
    )
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), np.sqrt(squared), atol=1e-12)


def test_faces_without_area_change_nothing():
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    vertices = np.vstack([box.vertices, box.vertices[box.edges[0]].mean(axis=0)])
    flat = [[*box.edges[0], 8], [0, 0, 0], [1, 1, 2]]
    clean, dirty = (
        MeshPart(vertices, np.array(faces)) for faces in (box.faces, [*box.faces, *flat])
    )
    frames = grid_frames(body_geometry([[clean]]))
    for expected, nodes in zip(mesh_nodes(frames, clean), mesh_nodes(frames, dirty), strict=True):
        np.testing.assert_allclose(nodes[:, 0], expected[:, 0], atol=1e-12)
        assert np.isfinite(nodes).all()
