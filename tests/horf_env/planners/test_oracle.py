"""The oracle: knows the way, and gets there."""

import gymnasium as gym
import numpy as np
import pytest

import horf_env  # noqa: F401  registers the environment
from horf_env.planners import PLANNERS, OraclePlanner


def drive(env, steps=1000):
    planner = OraclePlanner()
    observation, info = env.reset(seed=0, options={"instance": 0, "split": "validation"})
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
    info = drive(env)
    env.close()
    assert info["is_success"]
    assert not info["is_collision"]


def test_is_a_planner_by_name():
    assert PLANNERS["oracle"] is OraclePlanner


def test_needs_a_reset():
    with pytest.raises(RuntimeError, match="reset"):
        OraclePlanner().act({})
