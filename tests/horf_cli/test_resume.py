"""Runs that end badly, and go on."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import safetensors.torch
import torch as th
from horf_cli.atomic_files import StorageError
from horf_cli.checkpoints import checkpoints
from horf_cli.config_files import make_config
from horf_cli.exit_codes import CliError
from horf_cli.metrics import DamagedFileWarning, read_evaluations, read_metrics
from horf_cli.runs import RunFolder
from horf_cli.training import train

TIMEOUT = 120.0  # s, on a busy machine
WALL = {"wall_time", "planning_time", "total_time", "planning_p50", "planning_p99"}
OPTIONS = ("algo=sac", "env.scene=room", "env.action_layer=joint_velocity", "steps=60")
SMALL = (
    "batch_size=8",
    "protocol.every=20",
    "protocol.episodes=1",
    "protocol.final_episodes=1",
    "storage.checkpoint_every=10",
)


def config(*parameters):
    return make_config(parameters=[*OPTIONS, *SMALL, *parameters])


class Killed(BaseException):
    """What no code catches, as nobody catches a SIGKILL."""


class Listener:
    """Remembers notes, and acts on one of them."""

    def __init__(self, text="nothing", act=None):
        self.text, self.act, self.notes = text, act, []

    def update(self, snapshot):
        pass

    def note(self, text):
        self.notes.append(text)
        if self.text in text:
            self.act()


def killed():
    raise Killed


def kill_at(step):
    return Listener(f"evaluation at step {step}", killed)


def outcome(folder):
    """All that a run leaves behind and that is no time."""
    metrics = [
        (row["step"], row["name"], row["value"])
        for row in read_metrics(folder).to_pylist()
        if not row["name"].startswith("time/")
    ]
    evaluations = [
        {name: value for name, value in row.items() if name not in WALL}
        for row in read_evaluations(folder).to_pylist()
    ]
    return metrics, evaluations


def weights(folder, name):
    newest = checkpoints(folder / "checkpoints")[0]
    return safetensors.torch.load_file(newest.verified(name))


def assert_same(a, b):
    assert outcome(a) == outcome(b)
    for name in ("policy.safetensors", "best.safetensors"):
        left, right = weights(a, name), weights(b, name)
        assert left.keys() == right.keys()
        assert all(th.equal(left[key], right[key]) for key in left)


@pytest.fixture(scope="module", autouse=True)
def short_episodes_without_recordings():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("horf_env.env.MAX_STEPS", 12)
        patch.setattr("horf_cli.evaluator.save_recording", lambda *_, **__: None)
        yield


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    folder = tmp_path_factory.mktemp("straight")
    train(config(), folder)
    return folder


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """A run that was killed at its second evaluation, in the middle of an episode."""
    folder = tmp_path_factory.mktemp("half")
    with pytest.raises(Killed):
        train(config(), folder, progress=kill_at(40))
    return folder


@pytest.fixture
def copy(half, tmp_path):
    return Path(shutil.copytree(half, tmp_path / "copy"))


def test_killed_and_resumed_is_the_same_run(straight, copy):
    assert RunFolder(copy).read().status == "running"
    assert [c.step for c in checkpoints(copy / "checkpoints")] == [30, 20]
    listener = Listener()
    result = train(config(), copy, resume=True, exact=True, progress=listener)
    assert "resumed at step 30" in listener.notes
    assert (result.status, result.steps, result.episodes) == ("finished", 60, 1)
    assert_same(straight, copy)
    (resumption,) = RunFolder(copy).read().resumed
    assert (resumption.status, resumption.steps) == ("running", None)


@pytest.mark.parametrize(
    "other",
    [
        ("algo=bayes_dsac", "env.action_layer=sdf_qp", "buffer_size=15"),
        ("algo=ppo", "n_steps=8"),
    ],
)
def test_also_on_policy_or_with_the_qp_and_a_full_buffer(other, tmp_path):
    same = config(*other, "steps=32", "protocol.every=16")
    train(same, tmp_path / "a")
    with pytest.raises(Killed):
        train(same, tmp_path / "b", progress=kill_at(32))
    train(same, tmp_path / "b", resume=True, exact=True)
    assert_same(tmp_path / "a", tmp_path / "b")


def test_ctrl_c_while_it_evaluates_loses_nothing(straight, tmp_path):
    def press():
        signal.raise_signal(signal.SIGINT)

    listener = Listener("evaluation at step 40", press)
    result = train(config(), tmp_path, progress=listener)
    assert (result.status, result.steps, result.mean_return) == ("interrupted", 40, None)
    assert train(config(), tmp_path, resume=True, exact=True).status == "finished"
    assert_same(straight, tmp_path)


def test_a_truncated_checkpoint_is_named_and_the_one_before_is_used(straight, copy):
    newest = checkpoints(copy / "checkpoints")[0].path / "buffer.pkl"
    newest.write_bytes(newest.read_bytes()[:-100])
    listener = Listener()
    train(config(), copy, resume=True, exact=True, progress=listener)
    assert any(str(newest) in note and "the one before is used" in note for note in listener.notes)
    assert "resumed at step 20" in listener.notes
    assert_same(straight, copy)


def test_without_a_sound_checkpoint_nothing_is_overwritten(copy):
    for checkpoint in checkpoints(copy / "checkpoints"):
        (checkpoint.path / "model.zip").write_bytes(b"")
    before = outcome(copy)
    with pytest.raises(CliError, match="no sound checkpoint"):
        train(config(), copy, resume=True)
    assert outcome(copy) == before


def test_a_truncated_part_of_the_metrics_is_named_and_left_out(half, copy):
    part = sorted((copy / "metrics").iterdir())[0]
    part.write_bytes(part.read_bytes()[:50])
    with pytest.warns(DamagedFileWarning, match=part.name):
        table = read_metrics(copy)
    assert 0 < table.num_rows < read_metrics(half).num_rows


def test_a_second_process_is_refused(horf, copy):
    with RunFolder(copy).locked():
        result = horf("train", "--resume", copy)
    assert result.exit_code == 1
    assert f"{copy}: another process" in result.stderr


def test_a_folder_with_a_run_is_not_overwritten(copy):
    with pytest.raises(CliError, match="resume it"):
        train(config(), copy)
    with pytest.raises(CliError, match="other settings"):
        train(config("gamma=0.5"), copy, resume=True)


def test_exact_is_refused_for_other_versions(copy):
    run = RunFolder(copy)
    manifest = run.read()
    run.write(manifest.model_copy(update={"versions": manifest.versions | {"torch": "1.0"}}))
    with pytest.raises(CliError, match=r"torch was 1\.0"):
        train(config(), copy, resume=True, exact=True)
    assert run.read().status == "running"


def test_a_full_disk_stops_the_run_and_corrupts_nothing(straight, tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)

    def fill():
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))

    try:
        with pytest.raises(StorageError, match=r"cannot write .*-step00000040"):
            train(config(), tmp_path, progress=Listener("evaluation at step 40", fill))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    manifest = RunFolder(tmp_path).read()
    assert manifest.status == "failed"
    assert "cannot write" in manifest.error
    assert not list(tmp_path.rglob("*.part"))
    train(config(), tmp_path, resume=True, exact=True)
    assert_same(straight, tmp_path)


def test_a_read_only_folder_is_named(horf):
    result = horf("train", "--out", "/proc/runs", "--steps", 10)
    assert result.exit_code == 1
    assert "cannot write /proc/runs" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_divergence_fails_with_the_last_good_checkpoint(tmp_path):
    with pytest.raises(CliError, match=r"learning_rate|loss"):
        train(config("learning_rate=1e18", "learning_starts=30"), tmp_path)
    manifest = RunFolder(tmp_path).read()
    assert manifest.status == "failed"
    assert manifest.error
    assert checkpoints(tmp_path / "checkpoints")[0].step >= 20


def test_sigkill_and_resumed_from_the_shell(straight, tmp_path):
    program = (
        "import horf_env.env; horf_env.env.MAX_STEPS = 12; from horf_cli.main import main; main()"
    )
    command = [sys.executable, "-c", program, "train"]
    parameters = [word for text in (*OPTIONS, *SMALL) for word in ("-p", text)]
    process = subprocess.Popen([*command, *parameters, "--out", str(tmp_path)], stderr=-3)
    path = wait_for(tmp_path, step=40, process=process)
    done = subprocess.run(
        [*command, "--resume", str(path), "--exact", "--json"],
        capture_output=True,
        text=True,
        check=True,
        timeout=TIMEOUT,
    )
    assert json.loads(done.stdout)["status"] == "finished"
    assert_same(straight, path)


def wait_for(root, *, step, process):
    """Kill the process as soon as there is a checkpoint of that step; returns the run's folder."""
    deadline = time.monotonic() + TIMEOUT
    while not list(root.glob(f"*/*/*/checkpoints/*-step{step:08d}")):
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.005)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    return next(root.glob("*/*/*"))
