import csv
import json

import pyarrow.parquet
import pytest
from horf_cli.environments import EnvSettings
from horf_cli.evaluation import plan, run_jobs
from horf_cli.runs import Protocol, RunFolder
from horf_cli.training import run_config

pytestmark = pytest.mark.usefixtures("short_episodes")

FAST = ("--scenes", "room", "--trials", 1, "--perception", "full")


def test_one_trial_as_json(horf_json):
    (summary,) = horf_json("evaluate", *FAST)["summaries"]
    assert (summary["scene"], summary["method"], summary["trials"]) == ("room", "hra", 1)
    rates = [summary[kind]["rate"] for kind in ("success", "collision", "timeout")]
    assert sum(rates) == 1.0
    assert summary["timeout"]["rate"] == 1.0  # no goal is within 25 steps
    assert summary["execution_time"] is None


def test_table_on_stdout_and_progress_on_stderr(horf):
    result = horf("evaluate", *FAST)
    assert result.exit_code == 0
    assert "100 % [21, 100]" in result.stdout
    assert "room 0 to 0" in result.stderr
    assert "room 0 to 0" not in result.stdout


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_one_row_a_trial(horf, tmp_path, suffix):
    path = tmp_path / f"t.{suffix}"
    assert horf("evaluate", *FAST[:2], "--trials", 2, "--out", path).exit_code == 0
    if suffix == "csv":
        rows = list(csv.DictReader(path.open()))
    else:
        rows = pyarrow.parquet.read_table(path).to_pylist()
    assert [int(row["instance"]) for row in rows] == [0, 1]
    assert {row["failure"] for row in rows} <= {"timeout", "collision"}
    assert all(float(row["path_length_ee"]) > 0.5 for row in rows)


def test_an_existing_file_is_not_overwritten(horf, tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("mine")
    result = horf("evaluate", *FAST, "--out", path)
    assert result.exit_code == 1
    assert str(path) in result.stderr
    assert path.read_text() == "mine"


@pytest.fixture
def broken(tmp_path):
    """A run whose checkpoint was damaged."""
    config = run_config(
        algo="sac",
        env=EnvSettings(scene="room"),
        steps=10,
        seed=0,
        threads=1,
        buffer_size=None,
        protocol=Protocol(),
    )
    folder = RunFolder.create(tmp_path, config)
    folder.last.write_bytes(b"damaged")
    return folder.path


def test_a_failed_job_is_listed_and_the_others_go_on(horf, broken):
    result = horf("evaluate", *FAST, "--methods", f"{broken},hra", "--json")
    assert result.exit_code == 3
    found = json.loads(result.stdout)
    assert [summary["method"] for summary in found["summaries"]] == ["hra"]
    (failed,) = found["failed_jobs"]
    assert failed["method"] == str(broken)
    assert "last.zip" in failed["error"]


def test_what_is_no_run_is_refused_at_once(horf, tmp_path):
    result = horf("evaluate", *FAST, "--methods", f"hra,{tmp_path}")
    assert result.exit_code == 1
    assert f"{tmp_path}: no run folder" in result.stderr
    assert "room 0 to 0" not in result.stderr


def test_a_method_named_twice_is_run_once(horf_json):
    (summary,) = horf_json("evaluate", *FAST, "--methods", "hra, hra")["summaries"]
    assert summary["trials"] == 1


def test_jobs_cover_every_trial_once():
    settings = [EnvSettings(scene="room"), EnvSettings(scene="forest")]
    jobs = plan(["a", "b"], settings, 23)
    for method in "ab":
        for scene in ("room", "forest"):
            numbers = [
                k
                for job in jobs
                for k in job.instances
                if job.method == method and job.env.scene == scene
            ]
            assert numbers == list(range(23))


def test_two_processes_find_what_one_finds():
    jobs = [*plan(["no such method"], [EnvSettings(scene="room")], 11)]
    seen = []
    alone = run_jobs(jobs, 1, seen.append)
    assert alone == run_jobs(jobs, 2, seen.append)
    assert [result.job for result in alone] == jobs
    assert len(seen) == 2 * len(jobs)
    assert all("unknown method" in result.error for result in alone)
