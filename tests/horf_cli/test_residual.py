"""Policies that correct a planner: training them, and evaluating them as planners."""

import numpy as np
import pytest
from horf_cli.algorithms import SettingError
from horf_cli.config import Protocol, TrainConfig
from horf_cli.environments import EnvSettings, make_env, reach_env
from horf_cli.guidance import guide
from horf_cli.models import buffer_megabytes, new_model
from horf_cli.policies import load_policy, policy_planner
from horf_cli.training import train
from horf_cli.training_envs import training_envs

from horf_env.errors import UnknownNameError
from horf_env.residual import ResidualActions

# The servo soon gets no further, so that corrections are due.
ENV = EnvSettings(scene="doorway", image=(16, 12), action_mode="residual", base_planner="hra")


class Pushing:
    """A model that pushes, the harder the farther the goal is."""

    def predict(self, observation, *, deterministic):
        push = np.tanh(observation["deviation"] + observation["advice"])
        return push.astype(np.float32), None


def test_a_policy_does_as_a_planner_what_it_did_in_training():
    training, plain = make_env(ENV), make_env(ENV.model_copy(update={"action_mode": "direct"}))
    assert isinstance(training, ResidualActions)
    planner = policy_planner(Pushing(), ENV)
    expected, _ = training.reset(seed=1)
    found, _ = plain.reset(seed=1)
    planner.reset(plain)
    for _ in range(4):
        action = Pushing().predict(expected, deterministic=True)[0]
        expected, _, terminated, truncated, _ = training.step(action)
        assert not terminated
        assert not truncated
        while reach_env(plain).record.time < reach_env(training).record.time:
            found = plain.step(planner.act(found))[0]
        for key, part in found.items():
            np.testing.assert_array_equal(part, expected[key])
    moved = reach_env(plain).record.state.T_world_base
    np.testing.assert_array_equal(moved, reach_env(training).record.state.T_world_base)
    training.close()
    plain.close()


def test_a_planner_gets_what_its_policy_was_trained_on_and_whole_actions():
    settings = EnvSettings(scene="room", limits="paper").for_planner(
        policy_planner(Pushing(), ENV.model_copy(update={"map_view": True}))
    )
    assert settings == EnvSettings(scene="room", limits="paper", image=(16, 12), map_view=True)


def test_demonstrations_are_the_planner_uncorrected():
    config = TrainConfig(env=ENV, steps=20, guided_steps=12)
    envs = training_envs(config)
    model = new_model(config, envs)
    assert guide(model, config).steps == 12
    actions = model.replay_buffer.actions[:12, 0]
    assert np.abs(actions).max() < 0.9
    assert buffer_megabytes(model) > 0.0
    envs.close()


def test_a_run_from_beginning_to_end_and_its_policy(tmp_path):
    config = TrainConfig(
        env=ENV,
        steps=12,
        guided_steps=8,
        settings={"batch_size": 8, "learning_starts": 0},
        protocol=Protocol(every=12, episodes=1, final_episodes=1),
    )
    result = train(config, tmp_path / "run")
    assert (result.status, result.steps, result.episodes) == ("finished", 12, 1)
    planner = load_policy(tmp_path / "run")
    assert planner.trained_in == ENV
    env = make_env(EnvSettings(scene="doorway").for_planner(planner))
    observation, _ = env.reset(seed=0)
    planner.reset(env)
    assert planner.act(observation).shape == (6,)
    env.close()


@pytest.mark.parametrize(
    "changes",
    [
        {"hand_over": 0.5},
        {"algo": "dagger"},
        {"env": ENV.model_copy(update={"action_layer": "joint_velocity"})},
    ],
)
def test_what_cannot_be_corrected_is_refused(changes):
    with pytest.raises(SettingError, match="action_mode"):
        TrainConfig(**{"env": ENV, "steps": 10} | changes).check()


def test_an_unknown_planner_is_named():
    with pytest.raises(UnknownNameError, match="'oracle'"):
        EnvSettings(base_planner="oracle").check()
