"""Critic loss of DSAC-T, variant A, for any number of critics: pure functions.

Two variants are public. Variant A is the one printed in the DSAC-T paper and the one whose
gradient is the paper's eq. `eq6` times a scale. Variant B (a Huber loss with a clipped ratio)
learns a deviation 1/sqrt(2) too small and is not offered.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import torch as th

from sb3_bayes_dsac.common.gaussian import bounded_error

# Added to sigma^2, sigma^3 and the squared mean sigma, in the units of each. Value of DSAC-T.
EPSILON: Final = 0.1
# Bound b of the sampled target in mean deviations; the paper names b without a value, this is
# DSAC-T's three-sigma rule.
BOUND_FACTOR: Final = 3.0


class Target(NamedTuple):
    """Targets of one batch, without gradient.

    Attributes:
        mean: Target of the means, T_q of the paper (eq. `eq7`), shape (B,).
        sample: Target of the deviations, a sample of T_z, shape (B,).
    """

    mean: th.Tensor
    sample: th.Tensor


def track_mean_std(mean_std: th.Tensor, stds: th.Tensor, rate: float) -> None:
    """Move each critic's running mean of sigma in place, as DSAC-T does before the loss.

    DSAC-T's text averages sigma^2, its code averages sigma and squares the average; this is
    the code's way.

    Args:
        mean_std: Running means, shape (n,); zero stands for "nothing seen yet".
        stds: Standard deviations of this batch, shape (n, B).
        rate: Weight of this batch, in [0, 1]; DSAC-T's equals its tau. The first batch counts
            fully.
    """
    batch_mean = stds.detach().mean(dim=1)
    moved = th.where(mean_std == 0.0, batch_mean, th.lerp(mean_std, batch_mean, rate))
    # A batch that holds NaN stops training; what was learnt before stays good.
    mean_std.copy_(th.where(moved.sum() < math.inf, moved, mean_std))


def critic_loss(
    means: th.Tensor, stds: th.Tensor, target: Target, mean_std: th.Tensor
) -> th.Tensor:
    """Surrogate whose gradient is the critic gradient of the paper (its eq. below `eq11`).

    For critic i, with omega_i = mean_std_i^2, b_i = 3 mean_std_i and all factors constant:
        -(omega_i + eps) (T_q - Q_i) / (sigma_i^2 + eps)                     times grad Q_i
        -(omega_i + eps) ((clip T_z - Q_i)^2 - sigma_i^2) / (sigma_i^3 + eps)  times grad sigma_i
    The scale omega + eps and the eps in the denominators are DSAC-T's; the paper omits both.
    Only the gradient has a meaning, the value has none.

    Args:
        means: Online critics' means Q_i(s, a), shape (n, B).
        stds: Online critics' standard deviations, shape (n, B).
        target: Targets of this batch.
        mean_std: Running mean of sigma of each critic, shape (n,).

    Returns:
        Scalar: mean over the batch, sum over the critics.
    """
    q, std = means.detach(), stds.detach()
    error = bounded_error(target.sample, q, BOUND_FACTOR * mean_std)
    variance = std * std
    # Scales enter the factors, so that the graph holds two products and a sum.
    scale = (mean_std * mean_std + EPSILON)[:, None] / -q.shape[1]
    mean_factor = (target.mean - q) / (variance + EPSILON) * scale
    std_factor = (error * error - variance) / (variance * std + EPSILON) * scale
    return (mean_factor * means + std_factor * stds).sum()


def negative_log_likelihood(means: th.Tensor, stds: th.Tensor, target: Target) -> th.Tensor:
    """What the critics' gradient descends but for its scales, for the logger (paper, its J).

    Args:
        means: Online critics' means, shape (n, B).
        stds: Online critics' standard deviations, shape (n, B).
        target: Targets of this batch.

    Returns:
        Of each critic the mean over the batch, without the constant, shape (n,).
    """
    surprise = ((target.sample - means) / stds).square() / 2 + stds.log()
    return surprise.mean(dim=1)


def clipped_share(means: th.Tensor, target: Target, mean_std: th.Tensor) -> th.Tensor:
    """Share of sampled targets that the bound changes, over batch and critics, in [0, 1]."""
    outside = (target.sample - means).abs() > BOUND_FACTOR * mean_std[:, None]
    return outside.float().mean()
