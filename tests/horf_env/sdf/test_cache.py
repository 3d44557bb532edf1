"""The cache is reused, and rebuilt when it is damaged."""

import logging

import numpy as np
import pytest
import trimesh

from horf_env.robot import MeshPart, collision_parts
from horf_env.sdf import cache
from horf_env.sdf.cache import cached_fields
from horf_env.sdf.fields import Fields, bounds, build_fields
from horf_env.sdf.geometry import body_geometry
from horf_env.sdf.polytope import polytope_distance


@pytest.fixture(scope="module")
def finger():
    return body_geometry([[collision_parts()[8][1]]])


def test_fields_are_stored_and_read_back(finger, tmp_path):
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    with np.load(path) as stored:
        changed = dict(stored) | {"nodes": built.nodes + 1}
    np.savez(path.open("wb"), **changed)
    assert (cached_fields(finger, tmp_path).nodes == built.nodes + 1).all()


@pytest.mark.parametrize("damage", [b"", b"not a zip", b"PK\x03\x04 half a file"])
def test_a_damaged_cache_is_rebuilt_and_said_so(finger, tmp_path, caplog, damage):
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    path.write_bytes(damage)
    with caplog.at_level(logging.WARNING):
        again = cached_fields(finger, tmp_path)
    assert (again.nodes == built.nodes).all()
    assert str(path) in caplog.text
    assert "building them anew" in caplog.text


def test_fields_of_a_mesh_are_the_same_built_and_read_back(tmp_path):
    ball = trimesh.creation.icosphere(radius=0.05)
    meshes = [MeshPart(np.array(ball.vertices) + shift, np.array(ball.faces)) for shift in (0, 1)]
    geometry = body_geometry([[meshes[0], collision_parts()[8][1]], [meshes[1]]])
    built = cached_fields(geometry, tmp_path)
    read = cached_fields(geometry, tmp_path)
    assert (read.nodes == built.nodes).all()
    assert (read.near_faces == built.near_faces).all()
    assert (read.frames == built.frames).all()


def test_one_wrong_byte_anywhere_never_gives_wrong_fields(finger, tmp_path, monkeypatch):
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    monkeypatch.setattr(cache, "build_fields", lambda geometry: built)  # takes no time
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    headers = [*range(200), *range(len(whole) - 700, len(whole))]
    for place in [67, *headers[::10], *rng.integers(len(whole), size=50)]:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        again = cached_fields(finger, tmp_path)
        assert (again.nodes == built.nodes).all()
        assert (again.near_faces == built.near_faces).all()


def test_a_truncated_cache_is_rebuilt(finger, tmp_path):
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:-2000])
    assert (cached_fields(finger, tmp_path).nodes == built.nodes).all()


@pytest.mark.parametrize(
    "other",
    [
        {"nodes": np.zeros((5, 4), dtype=np.float32)},
        {"near_faces": np.zeros(5, dtype=np.int32)},
        {"frames": np.zeros((2, 11))},
        {"nodes": None},
        {"packed": np.zeros((5, 3), dtype=np.int16)},
        {"steps": np.zeros(1)},
    ],
)
def test_a_cache_with_other_contents_is_rebuilt(finger, tmp_path, caplog, other):
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    with np.load(path) as stored:
        arrays = dict(stored) | other
    np.savez(path.open("wb"), **{name: a for name, a in arrays.items() if a is not None})
    assert (cached_fields(finger, tmp_path).nodes == built.nodes).all()
    assert "building them anew" in caplog.text


def test_a_cache_of_another_version_is_not_read(finger, tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "_FORMAT", cache._FORMAT - 1)
    built = cached_fields(finger, tmp_path)
    (path,) = tmp_path.iterdir()
    np.savez(path.open("wb"), nodes=np.zeros(1), near_faces=np.zeros(1), frames=built.frames)
    monkeypatch.undo()
    assert (cached_fields(finger, tmp_path).nodes == built.nodes).all()
    assert len(list(tmp_path.iterdir())) == 2


def test_a_folder_that_cannot_be_written_is_no_obstacle(finger, tmp_path, caplog):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    fields = cached_fields(finger, blocked / "sdf")
    assert isinstance(fields, Fields)
    assert "could not be stored" in caplog.text


def test_bounds_hold_within_and_beyond_the_grids_and_are_tight(finger):
    fields = build_fields(finger)
    g, rng = finger, np.random.default_rng(0)
    heights = np.empty(len(g.faces))
    for padding, tightness in ((0.05, 0.02), (0.8, 0.1), (5.0, 1.0)):
        lower, upper = g.boxes[0, 0] - padding, g.boxes[0, 1] + padding
        for x, y, z in rng.uniform(lower, upper, (300, 3)):
            exact, *_ = polytope_distance(
                g.planes, g.faces, g.links, heights, 0, len(g.faces), x, y, z
            )
            low, high, _ = bounds(fields.nodes, fields.frames, 0, x, y, z)
            assert low <= exact <= high
            assert high - low <= tightness
