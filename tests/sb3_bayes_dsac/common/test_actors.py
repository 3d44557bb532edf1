"""The actor's samples against its distribution."""

from __future__ import annotations

import torch as th
from gymnasium import spaces
from stable_baselines3.common.distributions import SquashedDiagGaussianDistribution
from stable_baselines3.common.torch_layers import FlattenExtractor

from sb3_bayes_dsac.common.actors import Actor
from sb3_bayes_dsac.common.squashed_gaussian import squashed_sample

OBS = spaces.Box(-1, 1, (5,))


def test_samples_and_gradients_are_those_of_separate_heads() -> None:
    th.manual_seed(0)
    actor = Actor(OBS, spaces.Box(-1, 1, (3,)), [8], FlattenExtractor(OBS), 5)
    assert isinstance(actor.action_dist, SquashedDiagGaussianDistribution)
    features, noise = th.randn(7, 5), th.empty(7, 3)
    th.manual_seed(1)
    ours = actor.sample(features)
    th.manual_seed(1)
    mean, log_std, _ = actor.distribution_parameters(features)
    theirs = squashed_sample(mean, log_std, noise.normal_(), actor.action_dist.epsilon)
    th.testing.assert_close(ours, theirs)
    gradients = [
        th.autograd.grad(actions.sum() + log_prob.sum(), list(actor.parameters()))
        for actions, log_prob in (ours, theirs)
    ]
    th.testing.assert_close(*gradients)
