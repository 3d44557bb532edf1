"""Running the command line in this process, with episodes that end soon."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
import torch as th
from horf_cli.episodes import Trial
from horf_cli.main import app
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from horf_env.robot import MobileManipulator


@pytest.fixture
def horf():
    """`horf ARGS`: its result has exit_code, stdout and stderr."""
    return lambda *args: CliRunner().invoke(app, [str(arg) for arg in args])


@pytest.fixture
def horf_json(horf) -> Callable[..., Any]:
    """`horf ARGS --json` that has to succeed: its parsed result."""

    def run(*args: object) -> Any:
        result = horf(*args, "--json")
        assert result.exit_code == 0, result.output
        return json.loads(result.stdout)

    return run


@pytest.fixture
def make_trial() -> Callable[..., Trial]:
    """A made-up trial of method m in the room."""

    def make(failure: str = "", length: float = 1.0, **changes: Any) -> Trial:
        values = {
            "method": "m",
            "scene": "room",
            "instance": 0,
            "seed": 0,
            "success": not failure,
            "failure": failure,
            "steps": 10,
            "episode_return": 0.0,
            "execution_time": 0.5,
            "planning_time": 0.25,
            "total_time": 0.75,
            "planning_p50": 2.0,
            "planning_p99": 9.0,
            "path_length_base": length,
            "path_length_ee": 2 * length,
            "reference_length": 1.0,
            "spl": float(not failure) / max(length, 1.0),
            "mean_ee_speed": 4 * length,
            "min_distance": 0.05,
            "jerk_ee": 3.0,
            "unsolved": 1,
        }
        return Trial(**values | changes)

    return make


@pytest.fixture
def near_goal(tmp_path) -> Path:
    """A scene file whose goal HRA reaches in some steps."""
    start = {"base": [0.0, 0.0, 0.0], "arm": [0.0, -0.3, 0.0, -2.2, 0.0, 2.0, 0.785]}
    T = MobileManipulator.load().ee_pose(np.array(start["base"] + start["arm"]))
    goal = {
        "position": (T[:3, 3] + [0.05, 0.0, 0.0]).tolist(),
        "quaternion_xyzw": Rotation.from_matrix(T[:3, :3]).as_quat().tolist(),
    }
    parts = {"boxes": [], "cylinders": [], "spheres": []}
    path = tmp_path / "near.json"
    path.write_text(json.dumps({"name": "near", **parts, "start": start, "goal": goal}))
    return path


@pytest.fixture
def short_episodes(monkeypatch):
    """Episodes time out after 25 steps instead of 1000."""
    monkeypatch.setattr("horf_env.env.MAX_STEPS", 25)


@pytest.fixture(autouse=True)
def strict_rerun():
    """Wrong arguments of Rerun are errors and no mere warnings."""
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(autouse=True, scope="session")
def one_thread():
    """Small networks; threads that wait for a busy core make them ten times slower."""
    th.set_num_threads(1)
