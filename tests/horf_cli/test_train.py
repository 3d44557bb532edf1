import csv
import json
from pathlib import Path

import pytest
import torch as th
from horf_cli.exit_codes import CliError
from horf_cli.policies import load_policy
from horf_cli.runs import RunFolder

from horf_env.recording import summarise
from sb3_bayes_dsac import BayesDSAC

STEPS = 300


def train(horf_json, root, **options):
    args = {
        "scene": "room",
        "steps": STEPS,
        "evaluate-every": 150,
        "final-episodes": 3,
        "seed": 5,
        "out": root,
    } | options
    return horf_json("train", *(text for k, v in args.items() for text in (f"--{k}", v)))


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
        patch.setattr("horf_env.env.MAX_STEPS", 25)
        return train(horf_json, root)


@pytest.fixture(scope="module")
def folder(run):
    return RunFolder(Path(run["folder"]))


def test_result(run, root):
    assert run["status"] == "completed"
    assert run["steps"] == STEPS
    assert 0.0 <= run["success"]["rate"] <= 1.0
    path = Path(run["folder"])
    assert path.parent == root / "room" / "bayes_dsac"
    assert path.name.startswith("seed5-")


def test_manifest_tells_where_the_run_comes_from(folder):
    manifest = folder.read()
    assert manifest.status == "completed"
    assert manifest.steps_done == STEPS
    assert manifest.ended > manifest.started
    assert manifest.config.seed == 5
    assert manifest.config.arguments["gamma"] == 0.98
    assert manifest.config.protocol.final_episodes == 3
    assert manifest.versions["torch"] == th.__version__
    assert manifest.machine["cores"] >= 1
    assert manifest.command


def test_checkpoints_load_and_act(folder):
    for path in (folder.best, folder.last):
        model = BayesDSAC.load(path)
        assert model.num_timesteps in (150, STEPS)
    assert BayesDSAC.load(folder.last).num_timesteps == STEPS
    assert not list(folder.path.rglob("*.part"))


def test_run_has_learned(folder):
    model = BayesDSAC.load(folder.last)
    # From a fifth of the run on, one update in two steps.
    assert model._n_updates == pytest.approx((STEPS - STEPS // 5) / 2, abs=2)


def test_evaluations(folder):
    rows = list(csv.DictReader(folder.evaluations.open()))
    assert [(int(row["step"]), int(row["instance"])) for row in rows] == [
        (150, 0),
        (150, 1),
        (300, 0),
        (300, 1),
        (300, 0),
        (300, 1),
        (300, 2),
    ]


def test_recordings_can_be_read(folder):
    found = [summarise(path) for path in sorted(folder.recordings.glob("*.rrd"))]
    names = [summary.path.stem for summary in found]
    assert names == ["final", "step00000150", "step00000300"]
    assert all(summary.properties["split"] == "validation" for summary in found)
    assert all(1 <= summary.steps <= 25 for summary in found)


def test_logs(folder):
    header = (folder.logs / "progress.csv").read_text().splitlines()[0]
    assert "eval/success_rate" in header
    assert "train/critic_loss" in header
    assert list(folder.logs.glob("events.out.tfevents.*"))
    assert len((folder.path / "monitor.csv").read_text().splitlines()) > 5


@pytest.mark.usefixtures("short_episodes")
def test_run_folder_and_checkpoint_are_methods(folder, horf_json):
    methods = f"{folder.path},{folder.last}"
    found = horf_json("evaluate", "--scenes", "room", "--trials", 1, "--methods", methods)
    assert [summary["method"] for summary in found["summaries"]] == methods.split(",")


@pytest.mark.usefixtures("short_episodes")
def test_a_second_run_leaves_the_first_alone(folder, horf_json, root, monkeypatch):
    class SameTime:
        @staticmethod
        def now(zone=None):
            from datetime import datetime

            stamp = folder.path.name.split("-", 1)[1]
            return datetime.strptime(stamp, "%Y%m%d-%H%M%S").replace(tzinfo=zone)

    monkeypatch.setattr("horf_cli.runs.datetime", SameTime)
    before = {path: path.stat().st_mtime_ns for path in folder.path.rglob("*")}
    second = train(horf_json, root, steps=20)
    assert Path(second["folder"]).name == f"{folder.path.name}-2"
    assert before == {path: path.stat().st_mtime_ns for path in folder.path.rglob("*")}


def test_a_file_that_is_no_checkpoint_is_named(folder, tmp_path):
    copy = RunFolder(tmp_path)
    copy.manifest.write_bytes(folder.manifest.read_bytes())
    copy.last.parent.mkdir()
    copy.last.write_bytes(b"no zip")
    with pytest.raises(CliError, match=r"last\.zip"):
        load_policy(tmp_path)


def test_malformed_manifest_names_file_and_field(folder, tmp_path):
    data = json.loads(folder.manifest.read_text())
    data["config"]["steps"] = "many"
    copy = RunFolder(tmp_path)
    copy.manifest.write_text(json.dumps(data))
    with pytest.raises(CliError, match=r"manifest\.json: field 'config\.steps'"):
        copy.read()
