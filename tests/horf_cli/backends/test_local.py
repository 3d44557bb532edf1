import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from horf_cli.backends import make_backend


def run(function, jobs, workers=2):
    outcomes = make_backend("local", workers=workers).run(function, jobs)
    return sorted(outcomes, key=lambda outcome: outcome.index)


@pytest.mark.parametrize("workers", [1, 2])
def test_every_job_is_run(jobs, workers):
    found = run(jobs.square, [5, 6, 7], workers)
    assert [outcome.result[0] for outcome in found] == [25, 36, 49]
    assert not any(outcome.error for outcome in found)


@pytest.mark.parametrize("own", [None, "4"])
def test_numerical_libraries_of_several_workers_have_one_thread_each(jobs, monkeypatch, own):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    if own:
        monkeypatch.setenv("OMP_NUM_THREADS", own)
    found = run(jobs.square, [5, 6, 7], workers=2)
    assert {outcome.result[1] for outcome in found} == {"1"}
    assert os.environ.get("OMP_NUM_THREADS") == own


@pytest.mark.parametrize("workers", [1, 2])
def test_a_job_that_raises_is_an_outcome_and_the_others_go_on(jobs, workers):
    found = run(jobs.fail_on_three, [3, 4], workers)
    assert [outcome.error for outcome in found] == ["ValueError: three is 3", ""]
    assert found[1].result == 4


def test_a_job_whose_worker_dies_is_tried_again(jobs, tmp_path):
    (found,) = run(jobs.die_once, [str(tmp_path / "mark")])
    assert (found.result, found.error) == ("survived", "")


def test_a_job_that_kills_its_workers_is_an_outcome(jobs):
    found = run(jobs.die_always, [0, 1, 2])
    assert [outcome.result for outcome in found] == [0, None, 2]
    assert f"exit code -{int(signal.SIGKILL)}" in found[1].error


PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
import jobs_of_a_test
from horf_cli.backends import make_backend
if __name__ == "__main__":
    backend = make_backend("local", workers=2)
    list(backend.run(jobs_of_a_test.wait_for_interruption, [sys.argv[1]] * 3))
"""


def wait_until(condition):
    end = time.monotonic() + 60.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    assert condition()


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return "Z" not in Path(f"/proc/{pid}/stat").read_text().split()[2]


@pytest.mark.usefixtures("jobs")
@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGKILL])
def test_no_child_outlives_its_parent(tmp_path, kind):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    parent = subprocess.Popen([sys.executable, program, tmp_path], stderr=subprocess.DEVNULL)
    wait_until(lambda: sum(path.name.isdigit() for path in tmp_path.iterdir()) == 2)
    children = [int(path.name) for path in tmp_path.iterdir() if path.name.isdigit()]
    parent.send_signal(kind)
    parent.wait(timeout=60.0)
    wait_until(lambda: not any(map(is_alive, children)))
    stopped = {int(path.stem) for path in tmp_path.glob("*.stopped")}
    # Ctrl-C lets them write a checkpoint.
    assert stopped == (set(children) if kind == signal.SIGINT else set())
