import json
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest
from horf_cli.backends import make_backend
from horf_cli.backends.local import LocalBackend
from horf_cli.backends.serial import SerialBackend
from horf_cli.comparison import JobState, parse_seeds, plan, run_jobs, state
from horf_cli.config import Protocol, TrainConfig
from horf_cli.environments import EnvSettings
from horf_cli.exit_codes import UsageError
from horf_cli.metrics import read_evaluations, read_metrics
from horf_cli.runs import Manifest, RunFolder

STEPS = 20
# What depends on how busy the machine is.
TIMES = ("wall_time", "planning_time", "total_time", "planning_p50", "planning_p99")

PATCHED = """
import horf_env.env
from horf_cli import comparison

horf_env.env.MAX_STEPS = 25
_run_job = comparison.run_job


def run_job(job):
    return _run_job(job)
"""


@pytest.fixture
def base():
    return TrainConfig(
        steps=STEPS,
        env=EnvSettings(scene="room", perception="full"),
        protocol=Protocol(every=10, episodes=1, final_episodes=2),
        settings={"batch_size": 4},
    )


@pytest.fixture
def compare(horf, tmp_path):
    """`horf compare` of two algorithms with runs of a few seconds, in this process."""

    def run(*args):
        return horf(
            *("compare", "--algos", "sac,td3", "--seeds", "0", "--steps", STEPS),
            *("--scene", "room", "-p", "env.perception=full", "-p", "protocol.every=10"),
            *("-p", "protocol.episodes=1", "-p", "protocol.final_episodes=2"),
            *("-p", "batch_size=4"),
            *("--workers", 1, "--out", tmp_path / "runs", "--report", tmp_path / "report"),
            *args,
        )

    return run


def manifests(folder):
    return sorted(folder.rglob("manifest.json"))


@pytest.mark.parametrize(
    ("text", "seeds"), [("0-4", [0, 1, 2, 3, 4]), ("3", [3]), ("7, 1-2,2", [7, 1, 2])]
)
def test_seeds(text, seeds):
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize("text", ["", "a", "1-", "4-2", "-1", "1;2"])
def test_malformed_seeds_are_wrong_usage(text):
    with pytest.raises(UsageError, match="--seeds"):
        parse_seeds(text)


def test_jobs_are_all_combinations_and_each_computes_something_else(base, tmp_path):
    jobs = plan(base, algos=["sac", "tqc"], ratios=[1.0, 20.0], seeds=[0, 1], root=tmp_path)
    assert [job.name for job in jobs[1:3]] == ["tqc ratio 1 seed 0", "sac ratio 20 seed 0"]
    assert len({job.config.content_hash() for job in jobs}) == len(jobs) == 8


@pytest.mark.usefixtures("short_episodes")
def test_compare_runs_what_is_missing_and_reports(compare, tmp_path, monkeypatch):
    first = compare()
    assert first.exit_code == 0, first.output
    assert str(tmp_path / "report" / "report.html") in first.stdout
    assert "2 runs, 0 of them finished before" in first.stderr
    (sac, td3) = manifests(tmp_path / "runs")
    bias = json.loads((sac.parent / "q_bias.json").read_text())
    assert "normalized_mean" in bias or "time-outs" in bias["error"]
    report = (tmp_path / "report" / "report.md").read_text()
    assert "sac" in report
    assert sac.parent.name in report
    before = td3.stat().st_mtime_ns
    monkeypatch.setattr("horf_cli.report.write_report", lambda *args, **options: [])
    second = compare("--json")
    assert "2 runs, 2 of them finished before" in second.stderr
    assert [Path(run) for run in json.loads(second.stdout)["runs"]] == [sac.parent, td3.parent]
    assert td3.stat().st_mtime_ns == before
    plan = json.loads(compare("--dry-run", "--json", "--seeds", "0").stdout)
    assert [job["state"] for job in plan["jobs"]] == ["finished", "finished"]


@pytest.mark.usefixtures("short_episodes")
def test_dry_run_measures_speed_and_makes_nothing(compare, tmp_path, monkeypatch):
    monkeypatch.setattr("horf_cli.estimates._PROBE_STEPS", 40)
    result = compare("--dry-run", "--steps", 6000, "--seeds", "0-2", "--json", "--algos", "sac")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert [job["state"] for job in found["jobs"]] == ["new"] * 3
    # 6000 steps of some 10 to 100 ms.
    assert all(0.5 < job["minutes"] < 60.0 for job in found["jobs"])
    assert found["minutes"] == pytest.approx(3 * found["jobs"][0]["minutes"], rel=0.1)
    assert "measuring sac" in result.stderr
    assert not (tmp_path / "runs").exists()


@pytest.mark.usefixtures("short_episodes")
def test_a_run_that_was_begun_goes_on_in_its_folder(base, tmp_path):
    (job,) = plan(base, algos=["sac"], ratios=[None], seeds=[5], root=tmp_path)
    begun = RunFolder.create(tmp_path, job.config)
    begun.write(Manifest.of(job.config))
    other = RunFolder.create(tmp_path, job.config)
    other.write(Manifest.of(job.config.model_copy(update={"steps": 50})))
    (tmp_path / "room" / "sac" / "seed5-damaged").mkdir()
    (tmp_path / "room" / "sac" / "seed5-damaged" / "manifest.json").write_text("{")
    assert state(job).run == begun
    (found,) = run_jobs([job], make_backend("local", workers=1), lambda _: None)
    assert (found.run, found.finished, found.error) == (begun, True, "")
    assert begun.read().steps_done == STEPS


@pytest.fixture
def stub_train(monkeypatch):
    """Training that takes no time: it does something to the run, and then counts as finished."""

    def stub(act):
        def train(config, folder, *, resume):
            run = RunFolder(folder)
            run.write(Manifest.of(config))
            act(config)
            run.finish("finished", config.steps)
            return SimpleNamespace(status="finished")

        monkeypatch.setattr("horf_cli.comparison.train", train)
        monkeypatch.setattr("horf_cli.comparison.measure_q_bias", lambda run: None)
        monkeypatch.setattr("horf_cli.comparison.is_q_bias_missing", lambda run: False)

    return stub


def test_a_run_that_fails_is_tried_twice_and_listed(compare, tmp_path, stub_train):
    tried = []

    def act(config):
        tried.append(config.algo)
        if config.algo == "td3":
            raise RuntimeError("no\nluck")

    stub_train(act)
    result = compare()
    assert result.exit_code == 3
    assert "failed: td3 seed 0: RuntimeError: no luck" in result.stderr
    assert tried == ["sac", "td3", "td3"]
    assert "- td3 seed 0: RuntimeError: no luck" in (tmp_path / "report" / "report.md").read_text()
    assert len(manifests(tmp_path / "runs")) == 2  # the second attempt is in the same folder


def test_ctrl_c_ends_a_comparison_that_can_go_on(compare, tmp_path, stub_train):
    stub_train(lambda config: signal.raise_signal(signal.SIGINT))
    assert compare().exit_code == 130
    assert len(manifests(tmp_path / "runs")) == 1
    assert not (tmp_path / "report").exists()
    stub_train(lambda config: None)
    assert compare("--algos", "sac").exit_code == 0
    assert len(manifests(tmp_path / "runs")) == 1


def test_another_process_finds_the_same(base, tmp_path, monkeypatch):
    (tmp_path / "patched_jobs.py").write_text(PATCHED)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("horf_env.env.MAX_STEPS", 25)
    import patched_jobs

    monkeypatch.setattr("horf_cli.comparison.run_job", patched_jobs.run_job)
    tables = []
    for name, backend in (("here", SerialBackend()), ("there", LocalBackend(2))):
        jobs = plan(base, algos=["sac"], ratios=[None], seeds=[0], root=tmp_path / name)
        (found,) = run_jobs(jobs, backend, lambda _: None)
        assert not found.error
        tables.append(rows(found))
    assert tables[0] == tables[1]


def rows(found: JobState):
    evaluations = read_evaluations(found.run.path)
    metrics = read_metrics(found.run.path).to_pylist()
    kept = [name for name in evaluations.column_names if name not in TIMES]
    losses = [(row["step"], row["value"]) for row in metrics if row["name"] == "train/critic_loss"]
    assert losses
    return evaluations.select(kept).to_pylist(), losses


@pytest.mark.parametrize(
    ("args", "text"),
    [
        (["--algos", "sac,redk"], "did you mean 'redq'?"),
        (["--seeds", "0-"], "--seeds 0-"),
        (["--replay-ratios", "1,many"], "--replay-ratios 1,many"),
        (["--algos", "ppo", "--replay-ratios", "1"], "ppo has no replay buffer"),
        (["--scene", "rom"], "did you mean 'room'?"),
    ],
)
def test_wrong_usage(compare, tmp_path, args, text):
    result = compare(*args)
    assert result.exit_code == 2
    assert text in result.stderr
    assert list(tmp_path.iterdir()) == []
