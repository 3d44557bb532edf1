"""Runs of episodes: they go on where they were stopped, and stop when their time is over."""

from __future__ import annotations

import dataclasses
import importlib
import time
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def safety(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The script, found as it is when it runs."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return importlib.import_module("safety")


@pytest.fixture
def driven(safety, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """Episodes that were driven, in their order; they take no time."""
    episodes: list[tuple[str, int]] = []

    def drive(env, planner, scene, k, split):
        episodes.append((scene, k))
        values = {f.name: 1 for f in dataclasses.fields(safety.Episode)}
        return safety.Episode(**values | {"scene": scene, "instance": k, "outcome": "timeout"})

    class Env:
        def close(self) -> None:
            """Nothing to free."""

    monkeypatch.setattr(safety, "drive", drive)
    monkeypatch.setattr(safety.gym, "make", lambda *args, **options: Env())
    return episodes


def test_a_run_goes_on_where_it_was(safety, driven, tmp_path):
    path = tmp_path / "run.csv"
    options = {"split": "validation", "scenes": ["room", "forest"]}
    safety.perform(safety.Run(), path, instances=1, **options)
    assert driven == [("room", 0), ("forest", 0)]
    safety.perform(safety.Run(), path, instances=2, **options)
    assert driven[2:] == [("room", 1), ("forest", 1)]
    assert len(safety.read(path)) == 4


def test_no_episode_is_begun_after_the_deadline(safety, driven, tmp_path):
    path = tmp_path / "run.csv"
    options = {"split": "validation", "instances": 2, "scenes": ["room"]}
    safety.perform(safety.Run(), path, deadline=time.monotonic() - 1.0, **options)
    assert not driven
    assert safety.read(path) == []


def test_each_rule_of_the_map_is_off_in_one_run_alone(safety):
    """The runs differ from the default in what they are named after, and in nothing else."""
    map_rules = importlib.import_module("map_rules")
    default = map_rules.MapSettings()
    changed = {}
    for name, run in map_rules.RUNS.items():
        memory = run.env.get("memory")
        if isinstance(memory, map_rules.MapSettings):
            fields = dataclasses.asdict(memory).items() ^ dataclasses.asdict(default).items()
            changed[name] = {field for field, _ in fields}
    assert changed == {
        "no_fill_above": {"fill_above"},
        "no_fill_behind": {"fill_behind"},
        "fill_far_behind": {"fill_behind"},
        "no_free_goal": {"free_goal"},
        "no_guard_at_all": {"guard_unseen_ground"},
        "no_carving": {"carving"},
        "no_history": {"history"},
    }
    assert np.isfinite(map_rules.RUNS["no_history"].env["memory"].history)
