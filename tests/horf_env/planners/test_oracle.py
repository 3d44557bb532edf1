"""The oracle: knows the way, and gets there."""

import gymnasium as gym
import numpy as np
import pytest

import horf_env  # noqa: F401  registers the environment
from horf_env.planners import PLANNERS, OraclePlanner


def drive(env, steps=1000, instance=0):
    planner = OraclePlanner()
    options = {"instance": instance, "split": "validation"}
    observation, info = env.reset(seed=0, options=options)
    planner.reset(env)
    for _ in range(steps):
        action = planner.act(observation)
        assert action.shape == (6,)
        assert (np.abs(action) <= 1.0).all()
        observation, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            break
    return info


def test_reaches_a_goal_that_the_servo_does_not():
    env = gym.make("horf/Reach-v0", scene="doorway", perception="full")
    info = drive(env, instance=2)
    env.close()
    assert info["is_success"]
    assert not info["is_collision"]


def test_reaches_under_a_table_top_from_the_side():
    env = gym.make("horf/Reach-v0", scene="room", perception="full")
    info = drive(env, instance=3)
    env.close()
    assert info["is_success"]


def test_advice_does_not_wait():
    env = gym.make("horf/Reach-v0", scene="forest", perception="full")
    planner = OraclePlanner()
    env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    advice = [planner.advise() for _ in range(200)]  # nobody moves
    env.close()
    np.testing.assert_array_equal(advice, advice[:1] * 200)


def test_backs_off_where_it_gets_no_further():
    env = gym.make("horf/Reach-v0", scene="forest", perception="full")
    planner = OraclePlanner()
    observation, _ = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    ahead = [planner.act(observation)[0] for _ in range(90)]  # as if it were held
    env.close()
    assert ahead[0] >= 0.0
    assert min(ahead) < -0.1


def test_is_a_planner_by_name():
    assert PLANNERS["oracle"] is OraclePlanner


def test_needs_a_reset():
    with pytest.raises(RuntimeError, match="reset"):
        OraclePlanner().act({})
