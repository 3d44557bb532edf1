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
    corrected.reset(seed=3)
    found, reward, *_ = corrected.step(NOTHING)
    observation, _ = alone.reset(seed=3)
    planner = PLANNERS[name]()
    planner.reset(alone)
    total = 0.0
    while alone.unwrapped.record.time < corrected.unwrapped.record.time:
        observation, one, *_ = alone.step(planner.act(observation))
        total += float(one)
    for key, part in observation.items():
        np.testing.assert_array_equal(found[key], part)
    np.testing.assert_array_equal(found["advice"], planner.act(observation).astype(np.float32))
    assert reward == pytest.approx(total)
    alone.close()
    corrected.close()


def test_keeps_to_the_contract_of_environments():
    env = ResidualActions(plain(image=(16, 12)), "mapped")
    check_env(env, warn=False)
    env.close()


def held(residual, observation, steps):
    """Advice in an environment that does not move."""
    for _ in range(steps):
        advice = residual.advised(observation)["advice"]
    return advice


def test_corrections_count_where_the_planner_gets_no_further():
    env, residual = plain(), Residual("hra")
    observation, _ = env.reset(seed=0)
    residual.reset(env)
    residual.correct(ALL)
    advice = held(residual, observation, 60)
    np.testing.assert_allclose(residual.action(), advice, atol=1e-6)
    advice = held(residual, observation, 1)
    np.testing.assert_allclose(residual.action(), np.clip(advice + SHARE, -1.0, 1.0), atol=1e-6)
    observation["deviation"] = np.full(6, 1e-3, np.float32)
    advice = held(residual, observation, 1)
    assert 0.0 < np.abs(residual.action() - advice).max() < 0.01
    env.close()


def test_a_correction_lasts_and_is_due_only_where_the_planner_is_held():
    env, residual = plain(), Residual("hra")
    observation, _ = env.reset(seed=0)
    residual.reset(env)
    for _ in range(61):
        assert not residual.due
        residual.advised(observation)
        residual.action()
    assert residual.due
    residual.correct(ALL)
    for _ in range(HOLD):
        assert not residual.due
        residual.advised(observation)
        residual.action()
    assert residual.due
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


def test_a_step_lasts_until_a_correction_is_due_or_the_episode_ends(scene_file):
    env = ResidualActions(plain(scene_file(goal=(0.75, 0.05, 0.75))), "hra")
    env.reset(seed=0)
    *_, terminated, _, info = env.step(NOTHING)
    assert terminated
    assert info["is_success"]
    env.close()


def test_the_oracle_cannot_be_corrected():
    with pytest.raises(UnknownNameError, match="planner to be corrected 'oracle'"):
        Residual("oracle")
