"""Learnt returns against returns known in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch as th
from stable_baselines3.common.logger import configure

from sb3_bayes_dsac import DSACT, BayesDSAC

MakeModel = Callable[..., DSACT]

# Random reward of both tasks, in units of return: mean and deviation.
MEAN, STD = 2.0, 0.5


def random_rewards(n: int) -> np.ndarray:
    """Normal rewards whose sample mean and deviation are exactly those of the task."""
    z = np.random.default_rng(0).normal(size=n)
    rewards: np.ndarray = MEAN + STD * (z - z.mean()) / z.std()
    return rewards


def add(model: DSACT, state: float, next_state: float, reward: float, *, done: bool) -> None:
    """One transition of a task with one number as state, in the space of Pendulum."""
    assert model.replay_buffer is not None
    obs, next_obs = np.full((1, 3), state), np.full((1, 3), next_state)
    action = np.random.uniform(-1, 1, (1, 1))
    model.replay_buffer.add(obs, next_obs, action, np.array([reward]), np.array([done]), [{}])


def returns(model: DSACT, state: float) -> tuple[th.Tensor, th.Tensor]:
    """Mean and deviation of each critic, shape (n,), averaged over actions."""
    actions = th.linspace(-0.9, 0.9, 19)[:, None]
    with th.no_grad():
        means, stds = model.critic(th.full((19, 3), state), actions)
    return means.mean(dim=1), stds.mean(dim=1)


@pytest.fixture
def learner(make_model: MakeModel) -> MakeModel:
    """A model whose critics learn fast; the actor stays, lest it seek out unlikely actions."""

    def make(cls: type[DSACT], **kwargs: object) -> DSACT:
        model = make_model(
            cls, learning_rate=1e-2, ent_coef=0.0, tau=0.1, buffer_size=5_000, **kwargs
        )
        model.actor.requires_grad_(False)
        model.set_logger(configure(None, []))
        np.random.seed(0)
        return model

    return make


def fit(model: DSACT, steps: int) -> None:
    """Train fast, then slowly enough to average over batches."""
    model.train(steps, batch_size=256)
    model.lr_schedule = lambda _: 1e-3
    model.train(150, batch_size=256)


@pytest.mark.parametrize("cls", [BayesDSAC, DSACT])
def test_bandit(learner: MakeModel, cls: type[DSACT]) -> None:
    model = learner(cls)
    for reward in random_rewards(2_000):
        add(model, 0.0, 0.0, reward, done=True)
    fit(model, 200)
    mean, std = returns(model, 0.0)
    np.testing.assert_allclose(mean, MEAN, rtol=0.05)
    np.testing.assert_allclose(std, STD, rtol=0.05)


@pytest.mark.parametrize(
    ("fusion", "shrink"), [("min", 1.0), ("log_pool", 1.0), ("product", 1 / np.sqrt(2))]
)
def test_two_step_chain(learner: MakeModel, fusion: str, shrink: float) -> None:
    # State 0 leads to state 1 without reward, state 1 ends with a random one, so the return of
    # state 0 is gamma times that reward. "product" takes the critics for independent observers
    # and passes on 1 / sqrt(2) of their deviation. The bound (3 mean sigma, the mean being over
    # both states) costs about 2 % of the larger deviation.
    gamma = 0.8
    model = learner(DSACT, fusion=fusion, gamma=gamma, policy_delay=1)
    for reward in random_rewards(2_000):
        add(model, 0.0, 1.0, 0.0, done=False)
        add(model, 1.0, 1.0, reward, done=True)
    fit(model, 250)
    mean, std = returns(model, 0.0)
    np.testing.assert_allclose(mean, gamma * MEAN, rtol=0.05)
    np.testing.assert_allclose(std, gamma * STD * shrink, rtol=0.05)
