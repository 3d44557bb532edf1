"""`horf train` as a user runs it: one short run, looked at from all sides."""

import json
from pathlib import Path

import pytest
import torch as th
from horf_cli.checkpoints import checkpoints
from horf_cli.exit_codes import CliError
from horf_cli.metrics import read_evaluations, read_metrics
from horf_cli.policies import load_policy
from horf_cli.runs import RunFolder

from horf_env.recording import summarise
from sb3_bayes_dsac import BayesDSAC

STEPS = 120


def train(horf_json, root, *more, **options):
    args = {
        "scene": "room",
        "action-layer": "joint_velocity",
        "steps": STEPS,
        "evaluate-every": 60,
        "final-episodes": 3,
        "seed": 5,
        "out": root,
    } | options
    return horf_json("train", *(text for k, v in args.items() for text in (f"--{k}", v)), *more)


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def run(root):
    """One run for all tests of this file."""
    from horf_cli.main import app
    from typer.testing import CliRunner

    def horf_json(*args):
        result = CliRunner().invoke(app, [*map(str, args), "--json"])
        assert result.exit_code == 0, result.output
        return json.loads(result.stdout)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("horf_env.env.MAX_STEPS", 15)
        return train(horf_json, root, "-p", "batch_size=16")


@pytest.fixture(scope="module")
def folder(run):
    return RunFolder(Path(run["folder"]))


def test_result(run, root):
    assert run["status"] == "finished"
    assert run["steps"] == STEPS
    assert 0.0 <= run["success"]["rate"] <= 1.0
    path = Path(run["folder"])
    assert path.parent == root / "room" / "bayes_dsac"
    assert path.name.startswith("seed5-")


def test_manifest_tells_where_the_run_comes_from(folder):
    manifest = folder.read()
    assert manifest.status == "finished"
    assert manifest.steps_done == STEPS
    assert manifest.ended > manifest.started
    assert manifest.config.seed == 5
    assert manifest.config_hash == manifest.config.content_hash()
    assert (manifest.arguments["gamma"], manifest.arguments["batch_size"]) == (0.98, 16)
    assert manifest.config.protocol.final_episodes == 3
    assert manifest.versions["torch"] == th.__version__
    assert manifest.machine["cores"] >= 1
    assert manifest.command


def test_checkpoints_load_and_a_finished_run_keeps_no_replay_buffer(folder):
    newest = checkpoints(folder.checkpoints)[0]
    model = BayesDSAC.load(newest.verified("model.zip"))
    assert model.num_timesteps == STEPS
    # From a fifth of the run on, one update in two steps.
    assert model._n_updates == pytest.approx((STEPS - STEPS // 5) / 2, abs=2)
    assert not list(folder.path.rglob("*.part"))
    assert not list(folder.path.rglob("*.pkl"))


def test_evaluations(folder):
    rows = read_evaluations(folder.path).to_pylist()
    assert [(row["step"], row["protocol"], row["instance"]) for row in rows] == [
        (60, "paper", 0),
        (60, "paper", 1),
        (120, "paper", 0),
        (120, "paper", 1),
        (120, "validation", 0),
        (120, "validation", 1),
        (120, "validation", 2),
    ]
    assert all(1 <= row["length"] <= 15 for row in rows)
    # The policy at the end is that of the paper's last evaluation.
    assert [row["return"] for row in rows[2:4]] == [row["return"] for row in rows[4:6]]


def test_metrics(folder):
    table = read_metrics(folder.path)
    assert table.column_names == ["step", "wall_time", "name", "value"]
    found = table.to_pydict()
    assert {
        "rollout/ep_rew_mean",
        "rollout/success_rate",
        "eval/return",
        "eval/success_rate",
        "train/critic_loss",
        "time/environment",
        "time/update",
        "episode/return",
    } <= set(found["name"])
    assert found["step"] == sorted(found["step"])
    assert found["wall_time"] == sorted(found["wall_time"])
    last = dict(zip(found["name"], found["value"], strict=True))
    parts = [last[f"time/{part}"] for part in ("environment", "update", "evaluation", "storage")]
    assert all(part > 0.0 for part in parts)
    assert sum(parts) <= last["time/total"]
    assert list(folder.tensorboard.glob("events.out.tfevents.*"))


def test_recordings_can_be_read(folder):
    found = [summarise(path) for path in sorted(folder.recordings.glob("*.rrd"))]
    names = [summary.path.stem for summary in found]
    assert names == ["final", "step00000060", "step00000120"]
    assert all(summary.properties["split"] == "validation" for summary in found)
    assert all(1 <= summary.steps <= 15 for summary in found)


@pytest.mark.usefixtures("short_episodes")
def test_run_folder_and_policy_file_are_methods(folder, horf_json, tmp_path):
    file = next(folder.checkpoints.rglob("best.safetensors"))
    methods = f"{folder.path},{file}"
    options = ("--scenes", "room", "--trials", 1, "--out", tmp_path / "out")
    found = horf_json("evaluate", *options, "--methods", methods)
    assert [summary["method"] for summary in found["summaries"]] == methods.split(",")


def test_a_folder_is_never_used_twice(folder, horf_json, root, monkeypatch):
    class SameTime:
        @staticmethod
        def now(zone=None):
            from datetime import datetime

            stamp = folder.path.name.split("-", 1)[1]
            return datetime.strptime(stamp, "%Y%m%d-%H%M%S").replace(tzinfo=zone)

    monkeypatch.setattr("horf_cli.runs.datetime", SameTime)
    second = RunFolder.create(root, folder.read().config)
    assert second.path.name == f"{folder.path.name}-2"


def test_a_finished_run_has_nothing_to_resume(folder, run, horf_json):
    before = {path: path.stat().st_mtime_ns for path in folder.path.rglob("*") if path.is_file()}
    assert horf_json("train", "--resume", folder.path) == run
    assert before == {p: p.stat().st_mtime_ns for p in folder.path.rglob("*") if p.is_file()}


def test_malformed_manifest_names_file_and_field(folder, tmp_path):
    data = json.loads(folder.manifest.read_text())
    data["config"]["steps"] = "many"
    copy = RunFolder(tmp_path)
    copy.manifest.write_text(json.dumps(data))
    with pytest.raises(CliError, match=r"manifest\.json: field 'config\.steps'"):
        copy.read()


def test_policy_of_the_run_acts(folder):
    assert load_policy(folder.path).action_layer == "joint_velocity"
