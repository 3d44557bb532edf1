"""The critic loss against an independent float64 transcription of the printed gradients."""

from __future__ import annotations

import pytest
import torch as th

from sb3_bayes_dsac.common.losses import Target, clipped_share, critic_loss, track_mean_std

BATCH = 64


def draw(n: int) -> tuple[th.Tensor, th.Tensor, Target, th.Tensor]:
    """Means, deviations, targets (some far outside the bound) and mean deviations, float64."""
    generator = th.Generator().manual_seed(n)

    def normal(*shape: int) -> th.Tensor:
        return th.randn(*shape, dtype=th.float64, generator=generator)

    means = normal(n, BATCH).requires_grad_()
    stds = normal(n, BATCH).exp().requires_grad_()
    mean_std = normal(n).exp()
    return means, stds, Target(normal(BATCH), 5 * normal(BATCH)), mean_std


@pytest.mark.parametrize("n", [1, 2, 3])
def test_gradient_is_the_printed_one(n: int) -> None:
    means, stds, target, mean_std = draw(n)
    th.autograd.backward(critic_loss(means, stds, target, mean_std))
    assert means.grad is not None
    assert stds.grad is not None
    for i in range(n):
        scale = (mean_std[i].item() ** 2 + 0.1) / BATCH
        for k in range(BATCH):
            q, sigma = means[i, k].item(), stds[i, k].item()
            t_q, t_z = target.mean[k].item(), target.sample[k].item()
            bound = 3 * mean_std[i].item()
            clipped = min(max(t_z, q - bound), q + bound)
            d_mean = -scale * (t_q - q) / (sigma**2 + 0.1)
            d_std = -scale * ((clipped - q) ** 2 - sigma**2) / (sigma**3 + 0.1)
            assert means.grad[i, k].item() == pytest.approx(d_mean, rel=1e-9, abs=1e-12)
            assert stds.grad[i, k].item() == pytest.approx(d_std, rel=1e-9, abs=1e-12)


def test_without_scale_and_epsilon_it_descends_the_gaussian_likelihood() -> None:
    # omega / sigma^2 cancels at sigma = mean sigma large against eps; then the loss is the
    # negative log likelihood times sigma^2.
    sigma = 1e3
    mean = th.full((1, BATCH), 7.0, dtype=th.float64, requires_grad=True)
    std = th.full((1, BATCH), sigma, dtype=th.float64, requires_grad=True)
    sample = 7.0 + sigma * th.randn(BATCH, dtype=th.float64).clamp(-2.9, 2.9)
    mean_std = th.tensor([sigma], dtype=th.float64)
    loss = critic_loss(mean, std, Target(sample, sample), mean_std)
    surprise = ((sample - mean) / std) ** 2 / 2 + std.log()
    likelihood = surprise.mean() * sigma**2
    for ours, theirs in zip(
        th.autograd.grad(loss, (mean, std)), th.autograd.grad(likelihood, (mean, std)), strict=True
    ):
        th.testing.assert_close(ours, theirs, rtol=1e-5, atol=1e-9)


def test_critics_do_not_learn_from_each_other() -> None:
    means, stds, target, mean_std = draw(3)
    together = th.autograd.grad(critic_loss(means, stds, target, mean_std), (means, stds))
    alone = th.autograd.grad(
        critic_loss(means[1:2], stds[1:2], target, mean_std[1:2]), (means, stds)
    )
    for a, b in zip(together, alone, strict=True):
        th.testing.assert_close(a[1], b[1])
        assert b[0].abs().max() == 0.0


def test_mean_deviation_starts_at_the_first_batch_and_follows_slowly() -> None:
    running = th.zeros(2)
    track_mean_std(running, th.tensor([[1.0, 3.0], [4.0, 6.0]]), 0.1)
    assert running.tolist() == [2.0, 5.0]
    track_mean_std(running, th.tensor([[12.0, 12.0], [5.0, 5.0]]), 0.1)
    assert running.tolist() == pytest.approx([3.0, 5.0])


def test_clipped_share_counts_critics_and_rows() -> None:
    target = Target(th.zeros(2), th.tensor([0.0, 4.0]))
    share = clipped_share(th.zeros(2, 2), target, th.tensor([1.0, 2.0]))
    assert share.item() == pytest.approx(0.25)
