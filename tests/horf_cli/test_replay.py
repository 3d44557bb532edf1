import os
import shutil
import socket
import subprocess
import time
import urllib.request
from pathlib import Path

import pytest
from horf_cli.environments import EnvSettings, make_env
from horf_cli.episodes import run_episode
from horf_cli.methods import make_planner
from horf_cli.recordings import save_recording
from horf_cli.viewer import web_viewer

from horf_env.recording import EpisodeRecorder


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recordings") / "room.rrd"
    env, planner = make_env(EnvSettings(scene="room")), make_planner("hra")
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


def test_truncated_and_foreign_files_are_refused_by_name(horf, recording, tmp_path):
    broken = tmp_path / "broken.rrd"
    for content in (recording.read_bytes()[:-1000], b"no recording"):
        broken.write_bytes(content)
        result = horf("replay", broken, "--summary")
        assert result.exit_code == 1
        assert str(broken) in result.stderr
        assert len(result.stderr.strip().splitlines()) == 1


def test_nothing_to_replay(horf, tmp_path):
    assert "no recording" in horf("replay", tmp_path).stderr
    assert "no such file" in horf("replay", tmp_path / "x.rrd").stderr


def is_listening(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def test_web_viewer_answers_on_this_machine_only_and_ends(recording):
    with web_viewer(recording) as viewer:
        assert viewer.url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(viewer.url) as page:
            assert page.status == 200
        sockets = Path("/proc/net/tcp").read_text().splitlines()[1:]
        listening = [line.split()[1] for line in sockets]
        for port in viewer.ports:
            bound = {address for address in listening if address.endswith(f":{port:04X}")}
            assert bound == {f"0100007F:{port:04X}"}  # 127.0.0.1
    assert viewer.process.poll() is not None
    deadline = time.monotonic() + 10.0
    while is_listening(viewer.ports[0]) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(map(is_listening, viewer.ports))


@pytest.mark.parametrize(("display", "args"), [("", []), (":0", ["--web"])])
def test_without_a_display_or_if_asked_it_is_the_web_viewer(
    horf, recording, monkeypatch, display, args
):
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("horf_cli.commands.replay._serve", lambda path: print("web", path))
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
