import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

import horf_env  # noqa: F401, registers the environment
from horf_env.planners import PLANNERS
from horf_env.recording import EpisodeRecorder, RecordingError, summarise
from horf_env.recording.samples import view
from horf_env.robot import BODIES

STEPS = 24
PROPERTIES = {"method": "hra", "scene": "room", "instance": 4, "seed": 4, "outcome": "timeout"}


@pytest.fixture(autouse=True, scope="module")
def strict_rerun():
    """Wrong arguments of Rerun are errors and no mere warnings."""
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def drive(action_layer="sdf_qp", steps=STEPS):
    """The environment after some steps, and its records."""
    env = gym.make("horf/Reach-v0", scene="room", action_layer=action_layer)
    observation, _ = env.reset(seed=4, options={"instance": 4})
    records = [env.unwrapped.record]
    planner = PLANNERS["hra"]()
    planner.reset(env)
    for _ in range(steps):
        action = planner.act(observation) if action_layer == "sdf_qp" else np.full(9, 0.1)
        observation, *_ = env.step(action)
        records.append(env.unwrapped.record)
    return env.unwrapped, records


def save(env, records, path):
    recorder = EpisodeRecorder()
    for record in records:
        recorder.add(record)
    recorder.save(path, scene=env.scene, camera=env.camera, properties=PROPERTIES)


@pytest.fixture(scope="module")
def episode():
    env, records = drive()
    yield env, records
    env.close()


@pytest.fixture(scope="module")
def path(episode, tmp_path_factory):
    path = tmp_path_factory.mktemp("recordings") / "episode.rrd"
    save(*episode, path)
    return path


def rows(path, entity, component):
    """Values of a component over time."""
    (chunk,) = [c for c in RrdReader(path).stream() if c.entity_path == entity and not c.is_static]
    return chunk.to_record_batch().column(component).to_pylist()


def test_rerun_accepts_the_file(path):
    program = Path(sys.executable).with_name("rerun")
    done = subprocess.run([program, "rrd", "verify", path], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert list(path.parent.iterdir()) == [path]
    assert len(RrdReader(path).blueprints()) == 1


def test_bodies_move_as_they_did(path, episode):
    _, records = episode
    for k, body in enumerate(BODIES):
        entity = f"/world/robot/{body.frame}"
        found = np.array(rows(path, entity, "Transform3D:translation"))[:, 0]
        expected = [record.state.link_poses[k, :3, 3] for record in records]
        assert found == pytest.approx(np.array(expected), abs=1e-5)


def test_depth_is_stored_in_millimetres_at_ten_hertz(path, episode):
    _, records = episode
    images = rows(path, "/world/robot/base_link/camera/depth", "DepthImage:buffer")
    assert len(images) == STEPS // 2 + 1
    last = np.frombuffer(bytes(images[-1][0]), np.uint16).reshape(records[-1].depth.shape)
    assert last == pytest.approx(1000.0 * records[-1].depth, abs=0.5)


def test_clouds_are_thinned(path, episode):
    _, records = episode
    clouds = rows(path, "/world/cloud", "Points3D:positions")
    assert all(len(cloud) <= 1000 for cloud in clouds)
    known = {tuple(point) for point in records[-1].points.astype(np.float32).tolist()}
    assert {tuple(point) for point in clouds[-1]} <= known
    assert len(clouds[-1]) > min(len(known), 1000) / 2


def test_curves_hold_the_numbers_of_each_step(path, episode):
    _, records = episode
    clearance = rows(path, "/clearance", "Scalars:scalars")
    assert [value for (value,) in clearance] == [record.min_distance for record in records]
    linear = np.array(rows(path, "/twist/linear", "Scalars:scalars"))
    assert linear[:, :3] == pytest.approx(np.array([r.command.twist[:3] for r in records[1:]]))
    assert linear[:, 3:] == pytest.approx(np.array([r.twist_achieved[:3] for r in records[1:]]))
    reward = np.array(rows(path, "/reward", "Scalars:scalars"))
    assert reward[:, -1] == pytest.approx(reward[:, :-1].sum(axis=1))
    distances = np.array(rows(path, "/body_distances", "Scalars:scalars"))
    assert distances.shape == (STEPS, 9)
    seen = records[-1].command.obstacles.distance[:, 0]
    assert distances[-1] == pytest.approx(np.where(np.isfinite(seen), seen, np.nan), nan_ok=True)
    for entity in ("/qp/slack", "/qp/solve_time"):
        assert len(rows(path, entity, "Scalars:scalars")) == STEPS


def test_summary(path):
    found = summarise(path)
    assert PROPERTIES.items() <= found.properties.items()
    assert found.properties["rerun_version"] == rr.__version__
    assert found.steps == STEPS
    assert found.duration == pytest.approx(STEPS * 0.05)
    assert found.timelines["sim_time"] == pytest.approx((0.0, STEPS * 0.05))
    assert {"/world/goal", "/world/path/base", "/world/scene/obstacles"} <= set(found.entities)
    assert not found.success


def test_least_clearance_is_that_of_the_records(path, episode):
    _, records = episode
    assert summarise(path).min_distance == min(record.min_distance for record in records)


def test_twenty_seconds_stay_small(path, episode, tmp_path):
    env, records = episode
    save(env, records[:1], tmp_path / "x.rrd")
    still = (tmp_path / "x.rrd").stat().st_size
    a_step = (path.stat().st_size - still) / STEPS
    assert still + 400 * a_step < 5e6


def test_an_episode_without_a_qp_can_be_recorded(tmp_path):
    env, records = drive("joint_velocity", steps=3)
    save(env, records, tmp_path / "x.rrd")
    env.close()
    entities = summarise(tmp_path / "x.rrd").entities
    assert "/twist/linear" in entities
    assert "/qp/slack" not in entities
    assert "/body_distances" not in entities


def test_an_episode_that_only_began_can_be_recorded(episode, tmp_path):
    env, records = episode
    save(env, records[:1], tmp_path / "x.rrd")
    assert summarise(tmp_path / "x.rrd").steps == 0


def test_nothing_to_save(episode, tmp_path):
    env, _ = episode
    with pytest.raises(ValueError, match="nothing to save"):
        save(env, [], tmp_path / "x.rrd")


def test_a_missing_folder_is_an_error(episode, tmp_path):
    with pytest.raises(FileNotFoundError):
        save(*episode, tmp_path / "none" / "x.rrd")


def test_recorder_leaves_the_global_stream_alone(path):
    assert rr.get_global_data_recording() is None


def test_far_depth_does_not_wrap_around(episode):
    _, records = episode
    from dataclasses import replace

    far = replace(records[0], depth=np.full((2, 2), 100.0, np.float32))
    assert (view(far, 0).depth == np.iinfo(np.uint16).max).all()


@pytest.mark.parametrize("content", [b"", b"no recording", None])
def test_unreadable_files_are_named(path, tmp_path, content):
    broken = tmp_path / "broken.rrd"
    broken.write_bytes(path.read_bytes()[:2000] if content is None else content)
    with pytest.raises(RecordingError) as caught:
        summarise(broken)
    assert caught.value.path == broken
    assert str(broken) in str(caught.value)


def test_recordings_of_others_are_refused(tmp_path):
    stream = rr.RecordingStream("other")
    stream.save(tmp_path / "other.rrd")
    stream.log("x", rr.Points3D([[0, 0, 0]]), static=True)
    stream.disconnect()
    with pytest.raises(RecordingError, match="not of an episode"):
        summarise(tmp_path / "other.rrd")
