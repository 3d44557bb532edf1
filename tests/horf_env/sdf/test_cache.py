"""The cache is reused, and rebuilt when it is damaged."""

import logging

import numpy as np
import pytest

from horf_env.robot import collision_parts
from horf_env.sdf.cache import cached_fields
from horf_env.sdf.fields import Fields, build_fields
from horf_env.sdf.geometry import body_geometry


@pytest.fixture(scope="module")
def finger():
    return body_geometry([[collision_parts()[8][1]]])


def test_fields_are_stored_and_read_back(finger, tmp_path):
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    np.savez(path.open("wb"), values=built.values + 1, origins=built.origins, cells=built.cells)
    assert (cached_fields(finger, tmp_path).values == built.values + 1).all()


@pytest.mark.parametrize("damage", [b"", b"not a zip", b"PK\x03\x04 half a file"])
def test_a_damaged_cache_is_rebuilt_and_said_so(finger, tmp_path, caplog, damage):
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    path.write_bytes(damage)
    with caplog.at_level(logging.WARNING):
        again = cached_fields(finger, tmp_path)
    assert (again.values == built.values).all()
    assert str(path) in caplog.text
    assert "building them anew" in caplog.text


def test_a_truncated_cache_is_rebuilt(finger, tmp_path):
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:-2000])
    assert (cached_fields(finger, tmp_path).values == built.values).all()


def test_a_folder_that_cannot_be_written_is_no_obstacle(finger, tmp_path, caplog):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    fields = cached_fields(finger, blocked / "sdf")
    assert isinstance(fields, Fields)
    assert "could not be stored" in caplog.text


def test_nodes_are_upper_bounds_within_half_a_cell(finger):
    from horf_env.sdf.kernel import _interpolate, exact_distance

    fields = build_fields(finger)
    rng = np.random.default_rng(0)
    g, normal = finger, np.empty(3)
    for point in rng.uniform(g.boxes[0, 0] - 0.25, g.boxes[0, 1] + 0.25, (500, 3)):
        exact = exact_distance(point, g.planes, g.triangles, g.spheres, g.part_start, 0, 1, normal)
        value = _interpolate(*point, 0, 1, fields.values, fields.origins, fields.cells)
        half_diagonal = 0.5 * np.linalg.norm(fields.cells[0, 1])
        assert exact - 1e-7 <= value <= exact + half_diagonal
