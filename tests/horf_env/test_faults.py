"""Faults: each does what its name says, equally for equal seeds, and harms no number."""

import itertools

import gymnasium as gym
import numpy as np
import pytest

import horf_env  # noqa: F401  registers the environment
from horf_env.errors import UnknownNameError
from horf_env.faults import FAULTS, with_fault
from horf_env.planners import HraPlanner


def episode(name, steps=12, seed=3):
    env = gym.make("horf/Reach-v0", scene="room", disable_env_checker=True)
    if name:
        env = with_fault(env, name)
    planner = HraPlanner()
    observation, _ = env.reset(seed=seed, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    told = []
    for _ in range(steps):
        observation, reward, _, _, info = env.step(planner.act(observation))
        record = env.unwrapped.record
        told.append((observation, reward, info, record.command.velocity, record.depth))
    env.close()
    return told


@pytest.fixture(scope="module")
def healthy():
    return episode(None)


@pytest.mark.parametrize("name", FAULTS)
def test_equal_seeds_give_equal_and_finite_episodes(name):
    first, second = episode(name), episode(name)
    for (obs_a, reward_a, info_a, *_), (obs_b, reward_b, *_) in zip(first, second, strict=True):
        assert reward_a == reward_b
        assert np.isfinite([reward_a, *info_a["velocity"]]).all()
        for key in obs_a:
            np.testing.assert_array_equal(obs_a[key], obs_b[key])


def test_the_first_command_is_the_same_with_a_fault_of_the_drives(healthy):
    for name, part in (("base_slip", 0.95), ("velocity_lag", 1 - np.exp(-1))):
        _, _, info, commanded, _ = episode(name, steps=1)[0]
        np.testing.assert_allclose(commanded, healthy[0][3], atol=1e-9)
        np.testing.assert_allclose(info["velocity"][:2], part * commanded[:2], atol=1e-9)


def test_a_late_image_shows_the_world_of_100_ms_ago():
    frames = [observation["depth"][-1] for observation, *_ in episode("frame_late", 6)]
    on_time = [observation["depth"][-1] for observation, *_ in episode("base_slip", 1)]
    assert (frames[0] == frames[1]).all()  # the first image, until the next one comes
    assert not (frames[0] == on_time[0]).all()
    assert not (frames[1] == frames[2]).all()


def test_some_images_get_lost():
    frames = [observation["depth"][-1] for observation, *_ in episode("frame_dropped", 40)]
    repeated = np.mean([(a == b).all() for a, b in itertools.pairwise(frames)])
    assert 0.05 < repeated < 0.4


def test_one_in_five_pixels_is_invalid(healthy):
    lost = np.mean([(depth == 0).mean() for *_, depth in episode("pixels_invalid")])
    before = np.mean([(depth == 0).mean() for *_, depth in healthy])
    assert lost == pytest.approx(before + 0.2 * (1 - before), abs=0.03)


def test_noise_changes_depth_by_little(healthy):
    *_, noisy = episode("depth_noise", 1)[0]
    *_, ideal = healthy[0]
    both = (noisy > 0) & (ideal > 0) & (ideal < 2.0)
    assert 1e-4 < np.abs(noisy - ideal)[both].mean() < 0.05


def test_an_unknown_fault_is_named():
    with pytest.raises(UnknownNameError, match="frame_late"):
        with_fault(gym.make("horf/Reach-v0", disable_env_checker=True), "frame_lat")
