from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from horf_env.scenes.distance import obstacle_distance, outline_distance
from horf_env.scenes.scene import Box, Cylinder, Sphere
from horf_env.scenes.surface_points import surface_points


@pytest.mark.parametrize(
    ("body", "point", "expected"),
    [
        (Box((0, 0, 1), (1, 2, 0.5), 0.0), (1.3, 2.4, 1.0), 0.5),
        (Box((0, 0, 1), (1, 2, 0.5), np.pi / 2), (2.3, 1.4, 1.0), 0.5),
        (Box((0, 0, 1), (1, 2, 0.5), 0.0), (0.9, 0.0, 1.0), -0.1),
        (Cylinder((1, 0, 1), 0.5, 1.0), (1.0, 0.8, 2.4), 0.5),
        (Cylinder((1, 0, 1), 0.5, 1.0), (1.0, 0.4, 1.0), -0.1),
        (Sphere((0, 0, 1), 0.5), (0.0, 1.0, 1.0), 0.5),
        (Sphere((0, 0, 1), 0.5), (0.0, 0.0, 1.0), -0.5),
    ],
)
def test_distance_to_one_body(scene_of, body, point, expected):
    distance = obstacle_distance(scene_of(body), np.array([point]))
    np.testing.assert_allclose(distance, [expected], atol=1e-12)


def test_distance_agrees_with_the_sampled_surfaces(small_scene):
    spacing = 0.02
    points = np.random.default_rng(0).uniform([-3, -3, 0.3], [3, 3, 2], size=(500, 3))
    distance = obstacle_distance(small_scene, points)
    sampled, _ = cKDTree(surface_points(small_scene, spacing)).query(points)
    outside = distance > 0.3  # nearer than that, the part under the floor could be nearest
    assert outside.sum() > 300
    assert np.all(sampled[outside] >= distance[outside] - 1e-12)
    assert np.all(sampled[outside] <= distance[outside] + spacing)


def test_outlines_ignore_heights(scene_of):
    scene = scene_of(Box((0, 0, 5), (1, 1, 0.1), 0.0), Cylinder((4, 0, 1), 0.5, 0.1))
    distance = outline_distance(scene, np.array([[1.5, 0.0], [4.0, 1.0], [0.0, 0.0]]))
    np.testing.assert_allclose(distance, [0.5, 0.5, -1.0], atol=1e-12)


def test_no_obstacle_is_infinitely_far(scene_of):
    assert obstacle_distance(scene_of(), np.zeros((2, 3))).tolist() == [np.inf, np.inf]
    assert outline_distance(scene_of(), np.zeros((2, 2))).tolist() == [np.inf, np.inf]
