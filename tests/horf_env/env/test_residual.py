"""Actions that correct those of a planner."""

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.env_checker import check_env

from horf_env.errors import UnknownNameError
from horf_env.planners import PLANNERS
from horf_env.residual import EFFORT, HOLD, SHARE, Residual, ResidualActions

NOTHING, ALL = np.zeros(6, np.float32), np.ones(6, np.float32)


def plain(scene="doorway", **options):
    return gym.make("horf/Reach-v0", scene=scene, disable_env_checker=True, **options)


@pytest.mark.parametrize("name", ["hra", "mapped"])
def test_without_corrections_the_planner_drives(name):
    alone, corrected = plain(), ResidualActions(plain(), name)
    observation, _ = alone.reset(seed=3)
    planner = PLANNERS[name]()
    planner.reset(alone)
    total = 0.0
    for _ in range(3 * HOLD):
        observation, reward, *_ = alone.step(planner.act(observation))
        total += float(reward)
    corrected.reset(seed=3)
    found, rewards = zip(*(corrected.step(NOTHING)[:2] for _ in range(3)), strict=True)
    for key, part in observation.items():
        np.testing.assert_array_equal(found[-1][key], part)
    np.testing.assert_array_equal(found[-1]["advice"], planner.act(observation).astype(np.float32))
    assert sum(rewards) == pytest.approx(total)
    alone.close()
    corrected.close()


def test_keeps_to_the_contract_of_environments():
    env = ResidualActions(plain(image=(16, 12)), "mapped")
    check_env(env, warn=False)
    env.close()


def test_corrections_cover_their_share_and_fade_at_the_goal():
    env, residual = plain(), Residual("hra")
    observation, _ = env.reset(seed=0)
    residual.reset(env)
    advice = residual.advised(observation)["advice"]
    np.testing.assert_allclose(
        residual.action(ALL), np.clip(advice + SHARE, -1.0, 1.0), rtol=0, atol=1e-6
    )
    observation["deviation"] = np.full(6, 1e-3, np.float32)
    advice = residual.advised(observation)["advice"]
    assert 0.0 < np.abs(residual.action(ALL) - advice).max() < 0.01
    env.close()


def test_a_correction_costs_its_square(monkeypatch):
    rewards = []
    for effort in (0.0, EFFORT):
        monkeypatch.setattr("horf_env.residual.EFFORT", effort)
        env = ResidualActions(plain(), "hra")
        env.reset(seed=0)
        rewards.append(env.step(0.5 * ALL)[1])
        env.close()
    assert rewards[0] - rewards[1] == pytest.approx(6 * 0.25 * EFFORT)


def test_an_episode_ends_within_a_correction(scene_file):
    env = ResidualActions(plain(scene_file(goal=(0.75, 0.05, 0.75))), "hra")
    env.reset(seed=0)
    done, decisions = False, 0
    while not done:
        *_, terminated, truncated, info = env.step(NOTHING)
        done, decisions = terminated or truncated, decisions + 1
    assert info["is_success"]
    assert 0 < info["execution_time"] <= decisions * HOLD * 0.05
    env.close()


def test_the_oracle_cannot_be_corrected():
    with pytest.raises(UnknownNameError, match="planner to be corrected 'oracle'"):
        Residual("oracle")
