from __future__ import annotations

import numpy as np
import pytest
import trimesh

from horf_env.scenes.distance import obstacle_distance
from horf_env.scenes.scene import Box, Cylinder, Sphere
from horf_env.scenes.scene_mesh import triangles

BODIES = {
    "box": (Box((1, 2, 0.5), (0.3, 0.2, 0.5), 0.7), 8 * 0.3 * 0.2 * 0.5, 1e-12),
    "cylinder": (Cylinder((1, 2, 0.5), 0.3, 0.4), np.pi * 0.3**2 * 0.8, 0.01),
    "sphere": (Sphere((1, 2, 0.5), 0.3), 4 / 3 * np.pi * 0.3**3, 0.03),
}


@pytest.mark.parametrize("kind", BODIES)
def test_each_body_is_closed_and_oriented_outward(scene_of, kind):
    body, volume, excess = BODIES[kind]
    vertices, faces = triangles(scene_of(body))
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert vertices.dtype == np.float64
    assert faces.dtype == np.int64
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    # Circumscribed: never smaller than the body, and larger by a stated little only.
    assert volume * (1 - 1e-9) <= mesh.volume <= volume * (1 + excess + 1e-9)


@pytest.mark.parametrize("kind", BODIES)
def test_each_face_touches_the_true_body_from_outside(scene_of, kind):
    body = BODIES[kind][0]
    scene = scene_of(body)
    vertices, faces = triangles(scene)
    inside = trimesh.Trimesh(vertices, faces, process=False).sample(2000, seed=0)
    distance = obstacle_distance(scene, np.asarray(inside))
    assert distance.min() > -1e-9
    assert distance.max() < 0.011 * 0.3  # 1 % of the radius, the largest bulge that is documented


def test_bodies_stay_separate(small_scene):
    mesh = trimesh.Trimesh(*triangles(small_scene), process=False)
    assert mesh.body_count == 4


def test_floor_lies_under_everything_and_faces_up(small_scene):
    vertices, faces = triangles(small_scene, floor=True)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    floor = mesh.face_normals[-2:]
    np.testing.assert_allclose(floor, [[0, 0, 1], [0, 0, 1]])
    corners = vertices[np.unique(faces[-2:])]
    assert np.all(corners[:, 2] == 0.0)
    obstacles, _ = triangles(small_scene)
    assert np.all(corners[:, :2].min(axis=0) <= obstacles[:, :2].min(axis=0) - 4.9)
    assert np.all(corners[:, :2].max(axis=0) >= obstacles[:, :2].max(axis=0) + 4.9)


def test_empty_scene_has_no_triangles(scene_of):
    vertices, faces = triangles(scene_of())
    assert vertices.shape == (0, 3)
    assert faces.shape == (0, 3)
