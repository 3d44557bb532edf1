"""Episodes in which the oracle drives first."""

import numpy as np
import pytest
from horf_cli.config import TrainConfig
from horf_cli.environments import EnvSettings, make_env, reach_env
from horf_cli.hand_over import HandOver

SETTINGS = EnvSettings(scene="doorway")


def distances(env):
    """Distance at the start of the scene, and when the episode is handed over."""
    inner = reach_env(env)
    goal = np.array(inner.scene.goal.position)
    start = np.array(inner.scene.start.base[:2])
    now = inner.record.state.T_world_ee[:3, 3]
    return np.linalg.norm(goal[:2] - start), np.linalg.norm(goal - now)


def test_episodes_begin_between_start_and_goal():
    env = HandOver(make_env(SETTINGS), 1.0)
    for seed in range(3):
        env.reset(seed=seed)
        start, now = distances(env)
        assert 0.25 < now < start
    env.close()


def test_without_a_share_nothing_happens():
    plain, wrapped = make_env(SETTINGS), HandOver(make_env(SETTINGS), 0.0)
    expected, found = plain.reset(seed=1)[0], wrapped.reset(seed=1)[0]
    for key, value in expected.items():
        np.testing.assert_array_equal(found[key], value)
    plain.close()
    wrapped.close()


@pytest.mark.parametrize("share", [-0.1, 1.1])
def test_a_share_is_a_share(share):
    with pytest.raises(ValueError, match="hand_over"):
        TrainConfig(hand_over=share)
