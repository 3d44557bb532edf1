"""Imitation of a teacher."""

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from stable_baselines3.common.buffers import DictReplayBuffer

from sb3_bayes_dsac import BayesDSAC, DAgger
from sb3_bayes_dsac.common.taught_buffer import TAKEN_ACTION, TEACHER_ACTION
from sb3_bayes_dsac.errors import ArgumentError
from tests.sb3_bayes_dsac.conftest import DepthReach

SMALL = {"learning_starts": 50, "buffer_size": 2_000, "batch_size": 64, "seed": 0, "device": "cpu"}


class Stacked(gym.Wrapper):
    """The newest five frames."""

    def reset(self, **kwargs):
        self.last, info = self.env.reset(**kwargs)
        return self.last, info

    def step(self, action):
        following, *outcome, info = self.env.step(action)
        frames = np.concatenate([self.last["depth"][1:], following["depth"][:1]])
        self.last = following | {"depth": frames}
        return self.last, *outcome, info


class Taught(Stacked):
    """The teacher goes against the state; every other step it takes over."""

    def reset(self, **kwargs):
        self.steps = 0
        return super().reset(**kwargs)

    def step(self, action):
        wanted = -0.8 * self.last["state"][:6]
        taken = wanted if self.steps % 2 else action
        self.steps += 1
        *outcome, info = super().step(taken)
        return *outcome, info | {TEACHER_ACTION: wanted, TAKEN_ACTION: taken}


def model(**kwargs):
    return DAgger("MultiInputPolicy", Taught(DepthReach()), 1e-3, **(SMALL | kwargs))


def error(learner):
    """Mean distance from what the teacher would do, on observations of its own."""
    space = learner.observation_space
    space.seed(7)
    observations = [space.sample() for _ in range(100)]
    batch = {key: np.stack([o[key] for o in observations]) for key in space.spaces}
    actions, _ = learner.predict(batch, deterministic=True)
    return np.abs(actions + 0.8 * batch["state"][:, :6]).mean()


def test_learns_what_the_teacher_does():
    learner = model()
    before = error(learner)
    learner.learn(1_500)
    assert error(learner) < 0.25 * before


def test_keeps_what_was_done_and_what_the_teacher_would_have_done():
    learner = model().learn(40)
    buffer = learner.replay_buffer
    state = buffer.observations["state"][:40, 0]
    np.testing.assert_allclose(buffer.teacher_actions[:40, 0], -0.8 * state[:, :6], atol=1e-6)
    same = np.isclose(buffer.actions[:40, 0], buffer.teacher_actions[:40, 0]).all(axis=1)
    assert same[1::2].all()
    assert not same[::2].any()


def test_the_deviation_becomes_small():
    learner = model().learn(1_500)
    observation = {key: space.sample()[None] for key, space in learner.observation_space.items()}
    with th.no_grad():
        tensors, _ = learner.policy.obs_to_tensor(observation)
        _, log_std, _ = learner.actor.get_action_dist_params(tensors)
    assert (log_std.exp() < 0.3).all()


def test_equal_seeds_give_equal_weights():
    one, other = (model().learn(120).policy.state_dict() for _ in range(2))
    assert all(th.equal(weight, other[name]) for name, weight in one.items())


def test_saves_and_loads(tmp_path):
    learner = model().learn(80)
    learner.save(tmp_path / "model")
    loaded = DAgger.load(tmp_path / "model", env=Taught(DepthReach()))
    assert error(loaded) == error(learner)
    loaded.learn(60)


def test_bayes_dsac_goes_on_from_its_policy():
    learner = model().learn(80)
    other = BayesDSAC("MultiInputPolicy", DepthReach(), **SMALL)
    other.policy.load_state_dict(learner.policy.state_dict())
    assert error(other) == error(learner)


def test_needs_a_teacher():
    learner = DAgger("MultiInputPolicy", Stacked(DepthReach()), **SMALL)
    with pytest.raises(ArgumentError, match="teacher_action"):
        learner.learn(2)


def test_needs_a_buffer_that_keeps_the_teacher():
    with pytest.raises(ArgumentError, match="TaughtReplayBuffer"):
        model(replay_buffer_class=DictReplayBuffer)
