"""Fields of meshes that are not convex: accuracy, signs, and what happens beyond the grids."""

import sys

import numpy as np
import pytest
import trimesh

from horf_env.errors import MissingAssetError
from horf_env.robot import MeshPart, visual_parts
from horf_env.sdf.arrays import shape_of
from horf_env.sdf.bodies import measure
from horf_env.sdf.fields import MESH, build_fields
from horf_env.sdf.geometry import body_geometry

# An L of two overlapping boxes: it intersects itself, and its corner is concave.
LONG, SHORT = (0.3, 0.1, 0.1), (0.1, 0.1, 0.3)


@pytest.fixture(scope="module")
def ell():
    boxes = [trimesh.creation.box(LONG), trimesh.creation.box(SHORT)]
    boxes[1].apply_translation([0.1, 0.0, 0.1])
    mesh = trimesh.util.concatenate(boxes)
    geometry = body_geometry([[MeshPart(np.array(mesh.vertices), np.array(mesh.faces))]])
    return shape_of(geometry, build_fields(geometry))


def measured(shape, point):
    """Distance of a point to the first body, and its gradient."""
    local, distance = np.array(point, dtype=float).reshape(3, 1), np.empty(1)
    measure(shape, np.empty(1), 0, local, distance)
    return distance[0], *local[:, 0]


def box_distance(point, centre, extents):
    outside = np.abs(point - centre) - 0.5 * np.array(extents)
    return np.linalg.norm(np.maximum(outside, 0.0)) + min(outside.max(), 0.0)


def exact(point):
    return min(box_distance(point, [0, 0, 0], LONG), box_distance(point, [0.1, 0, 0.1], SHORT))


def test_outside_the_field_is_accurate_and_its_gradient_is_its_derivative(ell):
    rng = np.random.default_rng(0)
    errors = []
    for point in rng.uniform([-0.2, -0.1, -0.1], [0.2, 0.1, 0.3], (400, 3)):
        true = exact(point)
        if not 0.0 < true < 0.05:
            continue
        distance, *gradient = measured(ell, point)
        errors.append(abs(distance - true))
        step = 1e-7 * rng.normal(size=3)
        ahead = measured(ell, point + step)[0]
        assert (ahead - distance) == pytest.approx(step @ gradient, abs=1e-11)
    assert len(errors) > 100
    assert np.mean(errors) < 1e-4
    assert np.max(errors) < 3e-3


def test_inside_is_negative_also_where_the_boxes_overlap(ell):
    for point in ([-0.1, 0.0, 0.0], [0.1, 0.0, 0.2], [0.1, 0.01, 0.0]):
        assert measured(ell, point)[0] < 0


def test_beyond_the_grids_the_answer_is_never_too_large(ell):
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(100, 3))
    for direction in directions / np.linalg.norm(directions, axis=1, keepdims=True):
        point = (MESH.paddings[1] + 0.6) * direction * rng.uniform(1.0, 5.0)
        distance, *gradient = measured(ell, point)
        assert 0.0 < distance <= exact(point) + 1e-3
        assert np.linalg.norm(gradient) == pytest.approx(1.0, abs=0.05)


def test_an_open_mesh_has_an_inside():
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    lidless = MeshPart(np.array(box.vertices), np.array(box.faces[2:]))
    geometry = body_geometry([[lidless]])
    shape = shape_of(geometry, build_fields(geometry))
    assert measured(shape, np.zeros(3))[0] < 0
    assert measured(shape, np.full(3, 0.1))[0] > 0


def test_the_robot_has_visual_meshes_and_primitives():
    kinds = {type(part).__name__ for body in visual_parts() for part in body}
    assert kinds == {"ConvexPart", "MeshPart"}


def test_without_libigl_the_cure_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "igl", None)
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    geometry = body_geometry([[MeshPart(np.array(box.vertices), np.array(box.faces))]])
    with pytest.raises(MissingAssetError, match=r"pip install horf\[visual\]"):
        build_fields(geometry)
