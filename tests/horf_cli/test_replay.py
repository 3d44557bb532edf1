import os
import shutil
import signal
import socket
import subprocess
import time
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from horf_cli.environments import EnvSettings, make_env
from horf_cli.episodes import run_episode
from horf_cli.methods import Method, make_planner
from horf_cli.recordings import save_recording
from horf_cli.viewer import web_viewer

from horf_env.recording import EpisodeRecorder


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recordings") / "room.rrd"
    env, planner = make_env(EnvSettings(scene="room")), make_planner(Method("hra"))
    recorder = EpisodeRecorder()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("horf_env.env.MAX_STEPS", 25)
        trial = run_episode(
            env,
            planner,
            method="hra",
            scene="room",
            instance=1,
            observers=[lambda inner: recorder.add(inner.record)],
        )
    save_recording(recorder, env, trial, split="test", path=path)
    env.close()
    return path


def test_summary_tells_what_the_recording_holds(horf, recording):
    result = horf("replay", recording, "--summary")
    assert result.exit_code == 0
    for text in ("25 steps", "1.25 s", "success: False", "timeout", "sim_time", "/world/cloud"):
        assert text in result.stdout


def test_summary_as_json(horf_json, recording):
    found = horf_json("replay", recording)
    assert found["properties"]["method"] == "hra"
    assert found["properties"]["instance"] == 1
    assert found["steps"] == 25
    assert found["success"] is False


def test_a_folder_stands_for_its_newest_recording(horf_json, recording, tmp_path):
    for name, age in (("b", 10), ("a", 5), ("c", 20)):
        (tmp_path / name).mkdir()
        shutil.copy(recording, tmp_path / name / "x.rrd")
        os.utime(tmp_path / name / "x.rrd", (10**9 - age, 10**9 - age))
    assert horf_json("replay", tmp_path)["path"] == str(tmp_path / "a" / "x.rrd")


def test_nothing_to_replay(horf, tmp_path):
    assert "no recording" in horf("replay", tmp_path).stderr
    assert "no such file" in horf("replay", tmp_path / "x.rrd").stderr


def is_listening(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def assert_ends(viewer):
    assert viewer.process.poll() is not None
    deadline = time.monotonic() + 10.0
    while is_listening(viewer.ports[0]) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(map(is_listening, viewer.ports))


def test_web_viewer_answers_on_this_machine_only_and_ends(recording):
    with web_viewer([recording]) as viewer:
        assert viewer.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(viewer.url) as page:
            assert page.status == 200
        sockets = Path("/proc/net/tcp").read_text().splitlines()[1:]
        listening = [line.split()[1] for line in sockets]
        for port in viewer.ports:
            bound = {address for address in listening if address.endswith(f":{port:04X}")}
            assert bound == {f"0100007F:{port:04X}"}  # 127.0.0.1
    assert_ends(viewer)


def be_terminated():
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(10.0)  # SystemExit comes before


def test_a_terminated_program_leaves_no_viewer(recording):
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(SystemExit) as ended, web_viewer([recording]) as viewer:
        be_terminated()
    assert ended.value.code == 143
    assert_ends(viewer)
    assert signal.getsignal(signal.SIGTERM) == before


@pytest.mark.parametrize(("display", "args"), [("", []), (":0", ["--web"])])
def test_without_a_display_or_if_asked_it_is_the_web_viewer(
    horf, recording, monkeypatch, display, args
):
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("horf_cli.commands.replay._serve", lambda paths: print("web", *paths))
    assert horf("replay", recording, *args).stdout == f"web {recording}\n"


def test_with_a_display_it_is_a_window(horf, recording, monkeypatch):
    called = []
    run = subprocess.run

    def fake(command, **kwargs):
        if "verify" in command:
            return run(command, **kwargs)
        called.append(command)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(subprocess, "run", fake)
    assert horf("replay", recording).exit_code == 0
    assert called[0][1:] == [recording]


@pytest.fixture
def truncated(recording, tmp_path):
    """What a killed process leaves."""
    path = tmp_path / "truncated.rrd"
    path.write_bytes(recording.read_bytes()[:-1000])
    return path


def test_an_incomplete_recording_is_repaired_in_a_copy(horf, truncated):
    before = truncated.read_bytes()
    result = horf("replay", truncated, "--summary")
    assert result.exit_code == 0, result.output
    assert "25 steps" in result.stdout
    assert f"{truncated}: incomplete, a repaired copy is shown" in result.stderr.replace("\n", "")
    assert truncated.read_bytes() == before
    assert list(truncated.parent.iterdir()) == [truncated]


def test_a_foreign_file_is_refused_by_name(horf, tmp_path):
    path = tmp_path / "foreign.rrd"
    path.write_bytes(b"no recording")
    result = horf("replay", path, "--summary")
    assert result.exit_code == 1
    assert str(path) in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_in_a_folder_the_one_before_a_damaged_one_is_used(horf_json, recording, tmp_path):
    shutil.copy(recording, tmp_path / "good.rrd")
    os.utime(tmp_path / "good.rrd", (10**9, 10**9))
    (tmp_path / "newer.rrd").write_bytes(b"no recording")
    assert horf_json("replay", tmp_path)["path"] == str(tmp_path / "good.rrd")


def test_several_recordings_are_shown_together(horf_json, horf, recording, monkeypatch, tmp_path):
    other = shutil.copy(recording, tmp_path / "other.rrd")
    assert [one["path"] for one in horf_json("replay", recording, other)] == [
        str(recording),
        str(other),
    ]
    monkeypatch.setattr("horf_cli.commands.replay._serve", lambda paths: print("web", *paths))
    assert horf("replay", recording, other, "--web").stdout == f"web {recording} {other}\n"


def test_export_refuses_what_it_cannot_write(horf, recording, tmp_path):
    taken = tmp_path / "taken.mp4"
    taken.write_text("mine")
    for target in (taken, tmp_path / "x.avi"):
        result = horf("replay", recording, "--export", target)
        assert result.exit_code == 1
        assert str(target) in result.stderr
    assert taken.read_text() == "mine"


@pytest.mark.skipif(
    not list(Path("/usr/share/vulkan/icd.d").glob("*lvp*")), reason="no Vulkan driver in software"
)
def test_export_without_a_display(horf, recording, tmp_path, monkeypatch):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="extra horf[video]")
    monkeypatch.setattr("horf_cli.video._FRAME_RATE", 2)
    monkeypatch.delenv("DISPLAY", raising=False)
    assert horf("replay", recording, "--export", tmp_path / "x.mp4").exit_code == 0
    frames = imageio_ffmpeg.read_frames(str(tmp_path / "x.mp4"))
    width, height = next(frames)["size"]
    images = [np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in frames]
    assert len(images) == 3  # of 1.25 s, two a second and the first
    assert len(np.unique(images[0].reshape(-1, 3), axis=0)) > 500  # not a blank page
    assert (images[0] != images[2]).any()
