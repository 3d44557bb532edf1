from __future__ import annotations

import pytest
import torch as th
from stable_baselines3.common.distributions import SquashedDiagGaussianDistribution

from sb3_bayes_dsac.common.squashed_gaussian import squashed_sample

EPSILON = 1e-6


@pytest.mark.parametrize("scale", [0.1, 1.0, 4.0])
def test_numbers_and_gradients_are_those_of_sb3(scale: float) -> None:
    th.manual_seed(0)
    mean, log_std, noise = (scale * th.randn(50, 3, dtype=th.float64) for _ in range(3))
    leaves = (mean.requires_grad_(), log_std.requires_grad_())
    actions, log_prob = squashed_sample(*leaves, noise, EPSILON)
    theirs = SquashedDiagGaussianDistribution(3, EPSILON).proba_distribution(*leaves)
    raw = mean + log_std.exp() * noise
    th.testing.assert_close(actions, th.tanh(raw))
    expected = theirs.log_prob(th.tanh(raw), raw)
    th.testing.assert_close(log_prob, expected)
    weights = th.randn_like(actions), th.randn_like(log_prob)
    ours = th.autograd.grad((actions * weights[0]).sum() + (log_prob * weights[1]).sum(), leaves)
    sb3 = th.autograd.grad(
        (th.tanh(raw) * weights[0]).sum() + (expected * weights[1]).sum(), leaves
    )
    for a, b in zip(ours, sb3, strict=True):
        th.testing.assert_close(a, b)


def test_saturated_actions_stay_finite() -> None:
    mean = th.tensor([[50.0, -50.0]], requires_grad=True)
    log_std = th.tensor([[2.0, -20.0]], requires_grad=True)
    actions, log_prob = squashed_sample(mean, log_std, th.ones(1, 2), EPSILON)
    assert actions.tolist() == [[1.0, -1.0]]
    th.autograd.backward(actions.sum() + log_prob.sum())
    assert log_prob.isfinite().all()
    for leaf in (mean, log_std):
        assert leaf.grad is not None
        assert leaf.grad.isfinite().all()
