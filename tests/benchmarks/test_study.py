"""The learning studies: what a run records, and that a study goes on where it ended."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pyarrow.parquet as pq
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def study(monkeypatch: pytest.MonkeyPatch) -> dict[str, ModuleType]:
    """Modules of the studies, found as their scripts find them."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    names = ("learning", "replay_ratio", "study.queue", "study.runs", "study.summary")
    return {name: importlib.import_module(name) for name in names}


@pytest.fixture
def runs(study, monkeypatch: pytest.MonkeyPatch):
    """Two seeds of PPO and one of Bayes-DSAC, for a moment."""
    monkeypatch.setattr("study.training.BIAS_EPISODES", 1)
    new = study["study.runs"].Run
    task = study["study.runs"].Task(
        "pendulum", "Pendulum-v1", 60, evaluate_every=40, episodes=2, bias_steps=310
    )
    net = {"policy_kwargs": {"net_arch": [8]}}
    ppo = {"n_steps": 15, "batch_size": 20} | net
    bayes = {"learning_starts": 50} | net
    return [
        *(new(task, "ppo", seed, "small", ppo) for seed in (0, 1)),
        new(task, "bayes_dsac", 0, "small", bayes),
    ]


def test_runs_are_recorded_once(study, runs, tmp_path: Path, capsys) -> None:
    work_off = study["study.queue"].work_off
    work_off(runs, tmp_path, only="", budget=-1.0)
    assert not list(tmp_path.iterdir())
    work_off(runs, tmp_path, only="bayes*seed0", budget=np.inf)
    assert [path.name for path in tmp_path.iterdir()] == ["pendulum-bayes_dsac-small-seed0.parquet"]
    (file,) = tmp_path.iterdir()
    table = pq.read_table(file)
    assert table["step"].to_pylist() == [40, 60]
    assert set(table["algorithm"].to_pylist()) == {"bayes_dsac"}
    row = table.to_pylist()[-1]
    assert len(row["returns"]) == 2
    assert row["sigma_mean"] > 0.0
    assert row["cpu_s"] > 0.0
    # Ten updates in, Q is about zero and the return of Pendulum far below.
    assert row["q_bias"] == pytest.approx(-row["soft_return"], rel=0.2)
    metadata = json.loads(table.schema.metadata[b"run"])
    assert metadata["end"] == "completed"
    assert {"machine", "versions", "revision", "finished"} <= set(metadata)
    before = file.stat().st_mtime_ns
    capsys.readouterr()
    work_off(runs, tmp_path, only="", budget=np.inf)
    assert file.stat().st_mtime_ns == before
    assert len(list(tmp_path.iterdir())) == 3
    assert capsys.readouterr().err.count("begin ") == 2
    script = [sys.executable, str(BENCHMARKS / "learning_table.py"), str(tmp_path)]
    lines = subprocess.run(script, check=True, capture_output=True, text=True).stdout.splitlines()
    assert [line.split(" | ")[2:4] for line in lines[2:]] == [["bayes_dsac", "1"], ["ppo", "2"]]


def test_a_run_that_its_numbers_stop_is_recorded(study, runs, tmp_path: Path, monkeypatch) -> None:
    def stop(model, **_: object) -> None:
        if model.num_timesteps > 50:
            raise FloatingPointError("critic_loss is NaN")

    monkeypatch.setattr("sb3_bayes_dsac.BayesDSAC.train", stop)
    study["study.queue"].work_off(runs, tmp_path, only="bayes*seed0", budget=np.inf)
    (group,) = study["study.summary"].groups(tmp_path)
    assert group.stopped == ["stopped at step 51: critic_loss is NaN"]
    assert group.last[0]["step"] == 40


def test_what_a_stopped_run_missed_counts_as_its_last_return(study, tmp_path: Path) -> None:
    runs, records = study["study.runs"], importlib.import_module("study.records")
    task = runs.Task("t", "Pendulum-v1", 3, evaluate_every=1, episodes=1, bias_steps=310)
    for seed, returns in enumerate(([1.0, 2.0, 9.0], [1.0, -4.0])):
        rows = [{"step": k + 1, "returns": [value]} for k, value in enumerate(returns)]
        end = "completed" if len(rows) == 3 else "stopped"
        records.write(tmp_path, runs.Run(task, "sac", seed), rows, {"end": end})
    (group,) = study["study.summary"].groups(tmp_path)
    np.testing.assert_array_equal(group.returns, [[1.0, 1.0], [2.0, -4.0], [9.0, -4.0]])
    assert group.stopped == ["stopped"]


def test_estimate_is_the_mean_of_the_middle(study) -> None:
    (point,) = study["study.summary"].estimate(np.array([[0.0, 10.0, 20.0, 30.0, 1000.0]]))
    assert point.value == 20.0
    assert 0.0 <= point.low < 20.0 < point.high <= 1000.0


@pytest.mark.parametrize(("name", "n"), [("learning", 5 * 7 + 2 * 4 * 3), ("replay_ratio", 54)])
def test_names_of_runs_are_unique(study, name: str, n: int) -> None:
    names = [run.name for run in study[name].runs()]
    assert len(names) == len(set(names)) == n
