"""Demonstrations in the replay buffer before a policy acts."""

import numpy as np
import pytest
from horf_cli.algorithms import SettingError
from horf_cli.config import TrainConfig
from horf_cli.environments import EnvSettings
from horf_cli.guidance import guide
from horf_cli.models import new_model
from horf_cli.training_envs import training_envs

ENV = EnvSettings(scene="doorway", map_view=True)


@pytest.fixture(scope="module")
def guided():
    config = TrainConfig(env=ENV, steps=50, guided_steps=400, encoding="multi_scale")
    envs = training_envs(config)
    model = new_model(config, envs)
    shown = guide(model, config)
    envs.close()
    return model.replay_buffer, shown


def test_fills_the_buffer_with_that_many_steps(guided):
    buffer, shown = guided
    assert shown.steps == buffer.size() == 400
    assert shown.episodes >= 1
    assert 0 <= shown.successes <= shown.episodes


def test_shows_the_actions_of_the_oracle_and_what_followed(guided):
    buffer, _ = guided
    actions = buffer.actions[:400, 0]
    assert (np.abs(actions) <= 1.0).all()
    assert np.abs(actions).max(axis=0).min() > 0.0
    before, after = (
        part["deviation"][:400, 0] for part in (buffer.observations, buffer.next_observations)
    )
    continues = ~buffer.dones[:399, 0].astype(bool)
    np.testing.assert_array_equal(after[:-1][continues], before[1:][continues])
    distance = np.linalg.norm(before[:, :3], axis=1)
    assert distance.min() < distance[0]


def test_ends_that_are_no_goal_and_no_contact_are_time_outs(guided):
    buffer, shown = guided
    ends = buffer.dones[:400, 0].astype(bool)
    terminal = ends & ~buffer.timeouts[:400, 0].astype(bool)
    assert terminal.sum() >= shown.successes
    assert (np.abs(buffer.rewards[:400, 0][terminal]) > 10).all()


def test_can_be_stopped():
    config = TrainConfig(env=ENV, steps=50, guided_steps=400)
    envs = training_envs(config)
    model, seen = new_model(config, envs), []

    def check():
        seen.append(1)
        if len(seen) == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        guide(model, config, check)
    assert model.replay_buffer.size() == 7
    envs.close()


@pytest.mark.parametrize("changes", [{"algo": "ppo"}, {"n_envs": 2}])
def test_needs_a_buffer_and_one_environment(changes):
    config = TrainConfig(env=ENV, steps=50, guided_steps=10, **changes)
    with pytest.raises(SettingError, match="guided_steps"):
        config.check()


def test_layer_norm_is_for_our_algorithms():
    with pytest.raises(SettingError, match="layer_norm"):
        TrainConfig(algo="sac", layer_norm=True).check()
    TrainConfig(algo="redq", layer_norm=True).check()
