import os
import signal
import subprocess
import sys
import time

import pytest
from horf_cli.policies import load_policy
from horf_cli.runs import RunFolder

TIMEOUT = 120.0  # s, on a busy machine


@pytest.fixture
def training(tmp_path):
    """`horf train` that would take long, with its processes in a group, as in a terminal."""
    command = [sys.executable, "-c", "from horf_cli.main import main; main()", "train"]
    options = ["--scene", "room", "--steps", "500", "--n-envs", "2"]
    options += ["--action-layer", "joint_velocity", "--out", str(tmp_path)]
    process = subprocess.Popen(
        [*command, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    yield process
    process.kill()
    process.communicate()


def test_ctrl_c_leaves_a_loadable_checkpoint_and_says_where(training, tmp_path):
    assert training.stderr is not None
    for line in training.stderr:
        if line.startswith("step "):
            break
    os.killpg(training.pid, signal.SIGINT)
    out, err = training.communicate(timeout=TIMEOUT)
    assert training.returncode == 130, err
    (path,) = tmp_path.glob("room/bayes_dsac/*")
    folder = RunFolder(path)
    manifest = folder.read()
    assert manifest.status == "interrupted"
    assert manifest.steps_done >= 1
    assert f"horf train --resume {path}" in out.replace("\n", "")
    assert load_policy(path).action_layer == "joint_velocity"
    assert "Traceback" not in err
    deadline = time.monotonic() + TIMEOUT
    while is_alive(training.pid):  # children end soon after their parent
        assert time.monotonic() < deadline
        time.sleep(0.05)


def is_alive(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
