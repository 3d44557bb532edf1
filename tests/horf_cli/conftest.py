"""Running the command line in this process, with episodes that end soon."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
import rerun as rr
import torch as th
from horf_cli.main import app
from typer.testing import CliRunner


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
