from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from horf_env.scenes.distance import obstacle_distance
from horf_env.scenes.scene import Box, Cylinder, Sphere
from horf_env.scenes.surface_points import surface_points

BODIES = [
    Box((1, 2, 0.5), (0.3, 0.2, 0.5), 0.7),  # stands on the floor
    Box((1, 2, 0.1), (0.31, 0.22, 0.53), -2.0),  # sunk into the floor
    Box((1, 2, 1.3), (0.5, 0.4, 0.0125), 0.2),  # a board
    Cylinder((0, 1, 0.5), 0.3, 0.5),
    Cylinder((0, 1, 0.3), 0.03, 0.7),
    Cylinder((0, 1, 1.0), 0.2, 0.1),
    Sphere((0, 0, 0.3), 0.3),
    Sphere((0, 0, 0.05), 0.4),
    Sphere((0, 0, 1.0), 0.1),
]


def _random_surface(body: Box | Cylinder | Sphere, count: int) -> np.ndarray:
    """Random points of the true surface above the floor, without the faces that stand on it."""
    rng = np.random.default_rng(1)
    if isinstance(body, Box):
        mesh = trimesh.creation.box(extents=2 * np.array(body.half_extents))
        pose = trimesh.transformations.rotation_matrix(body.yaw, [0, 0, 1])
        pose[:3, 3] = body.center
        points = np.asarray(mesh.apply_transform(pose).sample(count, seed=1))
        bottom = body.center[2] - body.half_extents[2]
    elif isinstance(body, Cylinder):
        angle = rng.uniform(0, 2 * np.pi, count)
        end = rng.random(count) < 0.5
        r = np.where(end, body.radius * np.sqrt(rng.random(count)), body.radius)
        z = np.where(end, rng.choice((-1.0, 1.0), count), rng.uniform(-1, 1, count))
        points = np.column_stack([r * np.cos(angle), r * np.sin(angle), z * body.half_height])
        points, bottom = points + body.center, body.center[2] - body.half_height
    else:
        direction = rng.standard_normal((count, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        points, bottom = body.center + body.radius * direction, -np.inf
    on_bottom = np.abs(points[:, 2] - bottom) < 1e-9
    return points[(points[:, 2] >= 0.0) & ~(on_bottom & (bottom <= 0.0))]


@pytest.mark.parametrize("body", BODIES, ids=lambda b: f"{type(b).__name__}{b.center}")
@pytest.mark.parametrize("spacing", [0.03, 0.1])
def test_every_surface_point_has_a_sample_within_the_spacing(scene_of, body, spacing):
    samples = surface_points(scene_of(body), spacing)
    wanted = _random_surface(body, 4000)
    assert len(wanted) > 1000
    distance, _ = cKDTree(samples).query(wanted)
    assert distance.max() <= spacing


@pytest.mark.parametrize("body", BODIES, ids=lambda b: f"{type(b).__name__}{b.center}")
def test_samples_are_on_the_surface_and_not_under_the_floor(scene_of, body):
    scene = scene_of(body)
    samples = surface_points(scene, 0.05)
    np.testing.assert_allclose(obstacle_distance(scene, samples), 0.0, atol=1e-9)
    assert samples[:, 2].min() >= -1e-12


def test_no_more_samples_than_a_cover_needs(scene_of):
    # A square grid needs one sample for each 2 spacing^2; twice that is more than enough.
    box = Box((0, 0, 2), (0.5, 0.5, 0.5), 0.0)
    assert len(surface_points(scene_of(box), 0.05)) < 2 * 6.0 / (2 * 0.05**2)


def test_faces_on_the_floor_are_left_out(scene_of):
    samples = surface_points(scene_of(Box((0, 0, 0.5), (0.5, 0.5, 0.5), 0.0)), 0.05)
    inner = np.all(np.abs(samples[:, :2]) < 0.49, axis=1)
    assert np.all(samples[inner, 2] == 1.0)


def test_same_scene_same_points(small_scene):
    assert np.array_equal(surface_points(small_scene, 0.05), surface_points(small_scene, 0.05))


def test_body_below_the_floor_has_no_points(scene_of):
    buried = (Sphere((0, 0, -1), 0.5), Cylinder((0, 0, -1), 1, 0.5), Box((0, 0, -1), (1, 1, 1), 0))
    assert surface_points(scene_of(*buried), 0.05).shape == (0, 3)


@pytest.mark.parametrize("spacing", [0.0, -0.1, float("nan")])
def test_spacing_must_be_positive(small_scene, spacing):
    with pytest.raises(ValueError, match="spacing"):
        surface_points(small_scene, spacing)
