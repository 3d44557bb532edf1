import json

import pytest


@pytest.mark.parametrize(
    ("args", "nearest"),
    [
        (["train", "--algo", "bayes_dsca"], "bayes_dsac"),
        (["train", "--scene", "forrest"], "forest"),
        (["train", "--action-layer", "sdf_pq"], "sdf_qp"),
        (["train", "--limits", "ld6"], "ld60"),
        (["train", "--control", "papr"], "paper"),
        (["train", "--perception", "camra"], "camera"),
        (["train", "--simulation", "dynamical"], "dynamic"),
        (["evaluate", "--methods", "hra,hrra"], "hra"),
        (["evaluate", "--scenes", "room,isle"], "aisle"),
        (["evaluate", "--policy", "hfs=x", "--methods", "hfss,hra"], "hfss"),
        (["evaluate", "--backend", "rey"], "ray"),
        (["evaluate", "--fault", "frame_lost"], "frame_late"),
    ],
)
def test_unknown_name_is_wrong_usage_with_the_nearest_name(
    horf, tmp_path, monkeypatch, args, nearest
):
    monkeypatch.chdir(tmp_path)
    result = horf(*args)
    assert result.exit_code == 2
    assert f"did you mean {nearest!r}?" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_unknown_command_names_the_nearest(horf):
    result = horf("evalute")
    assert result.exit_code == 2
    assert "evaluate" in result.stderr


@pytest.mark.parametrize(
    "args",
    [["demo", "--instance", 50], ["evaluate", "--trials", 0], ["train", "--final-episodes", 21]],
)
def test_instance_beyond_the_test_set_is_wrong_usage(horf, tmp_path, monkeypatch, args):
    monkeypatch.chdir(tmp_path)
    assert horf(*args).exit_code == 2
    assert list(tmp_path.iterdir()) == []


def scene_with(**changes):
    scene = {
        "name": "mine",
        "boxes": [],
        "cylinders": [],
        "spheres": [],
        "start": {"base": [0, 0, 0], "arm": [0, -0.3, 0, -2.2, 0, 2.0, 0.785]},
        "goal": {"position": [2, 0, 0.7], "quaternion_xyzw": [1, 0, 0, 0]},
    }
    return json.dumps(scene | changes)


@pytest.mark.parametrize(
    ("text", "field"),
    [
        (scene_with(goal={"position": [2, 0], "quaternion_xyzw": [1, 0, 0, 0]}), "goal.position"),
        (scene_with(spheres=[{"center": [1, 1, 1], "radius": -1}]), "spheres[0].radius"),
        ("{", "whole file"),
    ],
)
def test_malformed_scene_file_is_one_line_with_file_and_field(horf, tmp_path, text, field):
    path = tmp_path / "mine.json"
    path.write_text(text)
    result = horf("train", "--scene", path, "--out", tmp_path / "runs")
    assert result.exit_code == 1
    (line,) = result.stderr.strip().splitlines()
    assert str(path) in line
    assert field in line
    assert not (tmp_path / "runs").exists()


def test_debug_lets_the_error_through(horf, tmp_path):
    result = horf("--debug", "replay", tmp_path / "none.rrd")
    assert result.exit_code == 1
    assert type(result.exception).__name__ == "CliError"


def test_bugs_keep_their_trace(horf, monkeypatch):
    def broken():
        raise ZeroDivisionError

    monkeypatch.setattr("horf_cli.checks.requirements", broken)
    assert isinstance(horf("doctor").exception, ZeroDivisionError)
