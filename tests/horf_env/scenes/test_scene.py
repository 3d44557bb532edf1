from __future__ import annotations

import json

import pytest

from horf_env.errors import SceneFileError
from horf_env.scenes.scene import Scene, load_scene


def test_json_has_the_documented_keys(small_scene):
    data = json.loads(small_scene.to_json())
    assert set(data) == {"name", "boxes", "cylinders", "spheres", "start", "goal"}
    assert set(data["boxes"][0]) == {"center", "half_extents", "yaw"}
    assert set(data["cylinders"][0]) == {"center", "radius", "half_height"}
    assert set(data["spheres"][0]) == {"center", "radius"}
    assert len(data["start"]["base"]) == 3
    assert len(data["start"]["arm"]) == 7
    assert set(data["goal"]) == {"position", "quaternion_xyzw"}


def test_round_trip_is_exact(small_scene):
    assert Scene.from_json(small_scene.to_json()) == small_scene


def test_integers_are_numbers(small_scene):
    text = small_scene.to_json().replace("[1.0,2.0,0.7]", "[1,2,0.7]")
    assert Scene.from_json(text) == small_scene


def test_load_scene(small_scene, tmp_path):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(json.loads(small_scene.to_json()), indent=2))
    assert load_scene(path) == small_scene


def test_scenes_are_frozen(small_scene):
    with pytest.raises(AttributeError):
        small_scene.boxes[0].yaw = 1.0


def _set(path: str, value: object):
    def edit(data: dict) -> None:
        *parents, last = path.split("/")
        for part in parents:
            data = data[int(part) if part.isdigit() else part]
        data[int(last) if last.isdigit() else last] = value

    return edit


def _delete(path: str):
    def edit(data: dict) -> None:
        *parents, last = path.split("/")
        for part in parents:
            data = data[int(part) if part.isdigit() else part]
        del data[last]

    return edit


@pytest.mark.parametrize(
    ("edit", "field", "expected"),
    [
        (_delete("boxes/1/yaw"), "boxes[1].yaw", "missing"),
        (_delete("goal"), "goal", "missing"),
        (_set("boxes/0/colour", "red"), "boxes[0].colour", "unknown"),
        (_set("start/base", [0.0, 0.0]), "start.base[2]", "missing"),
        (_set("start/arm", [0.0] * 8), "start.arm", "7 entries, got 8"),
        (_set("boxes/0/center/1", float("nan")), "boxes[0].center[1]", "finite number"),
        (_set("spheres/0/radius", float("inf")), "spheres[0].radius", "finite number"),
        (_set("boxes/0/half_extents/2", -0.1), "boxes[0].half_extents[2]", "greater than 0"),
        (_set("cylinders/0/radius", 0.0), "cylinders[0].radius", "greater than 0"),
        (_set("goal/quaternion_xyzw", [0.0, 0.0, 0.5, 1.0]), "goal.quaternion_xyzw", "unit"),
        (_set("boxes/0/yaw", "0.3"), "boxes[0].yaw", "number"),
        (_set("spheres", {}), "spheres", "array"),
        (_set("name", ""), "name", "at least 1 character"),
    ],
)
def test_malformed_file_names_file_field_and_expectation(
    small_scene, tmp_path, edit, field, expected
):
    data = json.loads(small_scene.to_json())
    edit(data)
    path = tmp_path / "broken.json"
    path.write_text(json.dumps(data))
    with pytest.raises(SceneFileError) as caught:
        load_scene(path)
    assert caught.value.source == str(path)
    assert caught.value.field == field
    assert expected in caught.value.expected
    assert all(part in str(caught.value) for part in (str(path), field, expected))


def test_all_wrong_fields_are_named(small_scene):
    data = json.loads(small_scene.to_json())
    data["nam"] = data.pop("name")
    with pytest.raises(SceneFileError, match="nam") as caught:
        Scene.from_json(json.dumps(data))
    assert caught.value.field == "name"


def test_broken_json_names_the_line(tmp_path):
    path = tmp_path / "broken.json"
    path.write_text('{\n  "name": "a",\n  "boxes": [,]\n}')
    with pytest.raises(SceneFileError, match=r"broken\.json.*line 3"):
        load_scene(path)


def test_missing_file_is_a_scene_file_error(tmp_path):
    with pytest.raises(SceneFileError, match="readable file"):
        load_scene(tmp_path / "nowhere.json")
