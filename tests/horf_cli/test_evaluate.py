import csv
import json
from dataclasses import fields

import pyarrow.parquet
import pytest
from horf_cli.backends.local import LocalBackend
from horf_cli.backends.serial import SerialBackend
from horf_cli.environments import EnvSettings, make_env
from horf_cli.episodes import Trial, run_episode
from horf_cli.evaluation import plan, run_jobs, run_trials
from horf_cli.methods import Method, make_planner

pytestmark = pytest.mark.usefixtures("short_episodes")

FAST = ("--scenes", "room", "--perception", "full")
# What depends on how busy the machine is.
TIMES = {"planning_time", "total_time", "planning_p50", "planning_p99"}


@pytest.fixture
def evaluate(horf, tmp_path):
    return lambda *args: horf("evaluate", *FAST, "--out", tmp_path / "out", *args)


def rows(folder):
    return pyarrow.parquet.read_table(folder / "trials.parquet").to_pylist()


def without_times(trials):
    return [{k: v for k, v in trial.items() if k not in TIMES} for trial in trials]


def test_one_trial_as_json(evaluate):
    result = evaluate("--trials", 1, "--json")
    assert result.exit_code == 0, result.output
    (summary,) = json.loads(result.stdout)["summaries"]
    assert (summary["scene"], summary["method"], summary["trials"]) == ("room", "hra", 1)
    rates = [summary[kind]["rate"] for kind in ("success", "collision", "stuck", "timeout")]
    assert sum(rates) == 1.0
    assert summary["timeout"]["rate"] == 1.0  # no goal is within 25 steps
    assert summary["execution_time"] is None
    assert summary["spl"] == 0.0


def test_table_on_stdout_progress_on_stderr_and_files(evaluate, tmp_path):
    result = evaluate("--trials", 2)
    assert result.exit_code == 0, result.output
    assert "0.0 [0.0, 65.8]" in result.stdout
    assert "70.1" in result.stdout  # the paper's
    assert "room 0 to 1" in result.stderr
    assert "room 0 to 1" not in result.stdout
    found = rows(tmp_path / "out")
    assert set(found[0]) == {field.name for field in fields(Trial)}
    assert [(row["instance"], row["seed"]) for row in found] == [(0, 0), (1, 1)]
    assert all(row["path_length_ee"] > 0.5 for row in found)
    assert all(0.1 < row["planning_p50"] <= row["planning_p99"] for row in found)
    assert all(row["total_time"] > row["execution_time"] == 1.25 for row in found)
    assert all(row["jerk_ee"] > 0.0 for row in found)
    assert found[0]["reference_length"] == 5.367  # of the file of instances
    for name in ("table.md", "table.csv", "table.tex"):
        assert (tmp_path / "out" / name).stat().st_size > 300
    assert next(csv.reader((tmp_path / "out" / "table.csv").open()))[2:] == ["hra", "hra †"]


def test_trials_that_are_stored_are_not_run_again(evaluate, tmp_path):
    assert evaluate("--trials", 2).exit_code == 0
    before = rows(tmp_path / "out")
    result = evaluate("--trials", 2)
    assert "(stored)" in result.stderr
    assert rows(tmp_path / "out") == before
    assert "(stored)" not in evaluate("--trials", 1, "--limits", "paper").stderr


def test_a_damaged_file_of_trials_is_named_and_run_again(evaluate, tmp_path):
    assert evaluate("--trials", 1).exit_code == 0
    before = rows(tmp_path / "out")
    (stored,) = (tmp_path / "out" / "jobs").iterdir()
    stored.write_bytes(stored.read_bytes()[:-100])
    result = evaluate("--trials", 1)
    assert result.exit_code == 0
    assert f"{stored.name} is damaged" in result.stderr
    assert without_times(rows(tmp_path / "out")) == without_times(before)


def test_a_failed_job_is_listed_and_the_others_go_on(evaluate, tmp_path):
    broken = tmp_path / "broken.safetensors"
    broken.write_bytes(b"damaged")
    result = evaluate("--trials", 1, "--policy", broken, "--methods", "horf,hra", "--json")
    assert result.exit_code == 3
    found = json.loads(result.stdout)
    assert [summary["method"] for summary in found["summaries"]] == ["hra"]
    (failed,) = found["failed_jobs"]
    assert failed["method"] == "horf"
    assert failed["error"]


def test_what_is_no_run_is_refused_at_once(evaluate, tmp_path):
    result = evaluate("--methods", f"hra,{tmp_path}")
    assert result.exit_code == 1
    assert f"{tmp_path}: no run folder" in result.stderr
    assert not (tmp_path / "out").exists()


def test_jobs_cover_every_trial_once():
    settings = [EnvSettings(scene="room"), EnvSettings(scene="forest")]
    methods = [Method("a"), Method("b")]
    jobs = plan(methods, settings, 23)
    for method in methods:
        for scene in ("room", "forest"):
            numbers = [
                k
                for job in jobs
                for k in job.trials
                if job.method == method and job.env.scene == scene
            ]
            assert numbers == list(range(23))
    assert len({job.file_name() for job in jobs}) == len(jobs)


def test_trials_beyond_the_instances_repeat_them_with_noise():
    assert not any(
        job.env.depth_noise for job in plan([Method("hra")], [EnvSettings(scene="room")], 50)
    )
    (*_, last) = plan([Method("hra")], [EnvSettings(scene="room")], 60)
    assert last.env.depth_noise
    job = type(last)(last.method, last.env, (52,))

    (trial,) = run_trials(job)
    assert (trial.instance, trial.seed) == (2, 52)


def test_noise_is_the_seeds():
    env, planner = (
        make_env(EnvSettings(scene="room", depth_noise=True)),
        make_planner(Method("hra")),
    )

    def last_image(seed):
        images = []
        run_episode(
            env,
            planner,
            method="hra",
            scene="room",
            instance=3,
            seed=seed,
            observers=[lambda inner: images.append(inner.record.depth)],
        )
        return images[-1]

    first = last_image(3)
    assert (last_image(53) != first).any()
    assert (last_image(3) == first).all()
    env.close()


def test_another_process_finds_the_same(near_goal, tmp_path):
    jobs = plan([Method("hra")], [EnvSettings(scene=str(near_goal))], 2)
    found = []
    for name, backend in (("here", SerialBackend()), ("there", LocalBackend(2))):
        (tmp_path / name).mkdir()
        (result,) = run_jobs(jobs, tmp_path / name, backend, lambda _: None)
        assert not result.error
        found.append(without_times([vars(trial) for trial in result.trials]))
    assert found[0] == found[1]
    assert [trial["success"] for trial in found[0]] == [True, True]
