"""Functions that worker processes can import."""

import importlib

import pytest

JOBS = """
import os
import signal
import time
from pathlib import Path


def square(number):
    return number**2, os.environ.get("OMP_NUM_THREADS")


def fail_on_three(number):
    if number == 3:
        raise ValueError(f"three\\nis {number}")
    return number


def die_once(path):
    # The first worker that comes here dies as if for lack of memory.
    try:
        Path(path).touch(exist_ok=False)
    except FileExistsError:
        return "survived"
    os.kill(os.getpid(), signal.SIGKILL)


def die_always(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def wait_for_interruption(folder):
    own = Path(folder, f"{os.getpid()}")
    own.touch()
    try:
        time.sleep(600)
    except KeyboardInterrupt:
        own.with_suffix(".stopped").touch()
        raise
"""


@pytest.fixture
def jobs(tmp_path, monkeypatch):
    """A module in the path of this process and of its workers."""
    (tmp_path / "jobs_of_a_test.py").write_text(JOBS)
    monkeypatch.syspath_prepend(tmp_path)
    module = importlib.import_module("jobs_of_a_test")
    yield module
    importlib.sys.modules.pop(module.__name__)
