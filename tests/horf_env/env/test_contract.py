"""What Gymnasium and Stable-Baselines3 demand of an environment."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3
from stable_baselines3.common.vec_env import SubprocVecEnv

from horf_env.env import HorfReachEnv
from horf_env.perception import CameraModel


def make(**options):
    return gym.make("horf/Reach-v0", disable_env_checker=True, **options)


def rollout(env, seed, steps=15):
    """Observations, rewards and ends of a random episode."""
    rng = np.random.default_rng(seed)
    observation, _ = env.reset(seed=seed)
    seen = [(observation, 0.0, False)]
    for _ in range(steps):
        observation, reward, terminated, truncated, _ = env.step(rng.uniform(-1, 1, 6))
        seen.append((observation, reward, terminated))
        if terminated or truncated:
            break
    return seen


def assert_equal(a, b):
    assert len(a) == len(b)
    for (obs_a, reward_a, end_a), (obs_b, reward_b, end_b) in zip(a, b, strict=True):
        for key in obs_a:
            np.testing.assert_array_equal(obs_a[key], obs_b[key])
        assert (reward_a, end_a) == (reward_b, end_b)


@pytest.mark.parametrize("action_layer", ["sdf_qp", "joint_velocity"])
def test_gymnasium_accepts_it(action_layer):
    env = make(scene="room", action_layer=action_layer, render_mode="rgb_array")
    check_env(env.unwrapped)


def test_stable_baselines_accepts_it():
    env = make(scene="forest")
    check_env_sb3(env)
    env.close()
    env.close()


@pytest.mark.parametrize("options", [{}, {"simulation": "dynamic"}, {"depth_noise": True}])
def test_same_seed_same_episode(options):
    first, second = make(scene="aisle", **options), make(scene="aisle", **options)
    assert_equal(rollout(first, seed=3), rollout(second, seed=3))
    assert_equal(rollout(first, seed=3), rollout(second, seed=3))  # and after a reset


def test_another_seed_is_another_episode():
    env = make(scene="aisle")
    a, b = rollout(env, seed=3, steps=1), rollout(env, seed=4, steps=1)
    assert (a[0][0]["deviation"] != b[0][0]["deviation"]).any()


def test_pickling_gives_the_same_environment():
    env = make(scene="doorway", limits="paper", perception="full")
    copy = pickle.loads(pickle.dumps(env))
    assert copy.unwrapped.limits.name == "paper"
    assert_equal(rollout(env, seed=1, steps=5), rollout(copy, seed=1, steps=5))


def test_it_runs_in_spawned_processes():
    envs = SubprocVecEnv([HorfReachEnv, HorfReachEnv], start_method="spawn")
    envs.seed(0)
    observation = envs.reset()
    assert observation["depth"].shape == (2, 5, 48, 64)
    observation, reward, _, info = envs.step(np.zeros((2, 6)))
    assert np.isfinite(reward).all()
    assert info[0]["qp_status"] == "solved"
    envs.close()


def test_the_map_may_have_finer_images_than_the_policy():
    fine = make(camera=CameraModel(width=96, height=72), image=(32, 24))
    whole = make(camera=CameraModel(width=96, height=72))
    small, large = fine.reset(seed=0)[0], whole.reset(seed=0)[0]
    assert fine.observation_space.contains(small)
    np.testing.assert_array_equal(small["depth"], large["depth"][:, 1::3, 1::3])
    np.testing.assert_array_equal(fine.unwrapped.record.points, whole.unwrapped.record.points)
    fine.close()
    whole.close()


def test_a_map_joins_the_observation_if_asked_for():
    env = make(scene="mixed", map_view=True)
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert observation["map"].shape == (3, 32, 32)
    seen = np.stack([env.step(np.zeros(6))[0]["map"] for _ in range(3)])
    assert seen[:, :2].any()
    env.close()
    plain = make()
    assert "map" not in plain.observation_space.spaces
    plain.close()
