"""Fusion of the critics' Gaussian returns into one: pure functions of means and deviations.

A rule sees the means and standard deviations of n critics, both of shape (n, B), and answers
one Gaussian per row of the batch. To add a rule, write a function and name it in `FUSIONS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final, NamedTuple

import torch as th

# Smallest standard deviation that a rule believes, in units of return. It keeps the logarithm
# finite where softplus underflows to zero; far below any return scale that float32 resolves.
MIN_STD: Final = 1e-8


class Fused(NamedTuple):
    """One Gaussian return per row of a batch, fused from n critics.

    Attributes:
        mean: Fused mean, shape (B,), in units of return.
        std: Fused standard deviation, shape (B,), in units of return.
        weights: Share of each critic in the fused mean, shape (n, B), columns sum to one.
    """

    mean: th.Tensor
    std: th.Tensor
    weights: th.Tensor


FusionRule = Callable[[th.Tensor, th.Tensor], Fused]


def product(means: th.Tensor, stds: th.Tensor) -> Fused:
    """Normalised product of the critics' densities (paper, eq. `eq11`, for any n >= 1).

    Precisions add: weights 1/sigma_i^2 over their sum, fused variance one over their sum. The
    paper derives it from Bayes' rule with a uniform prior, which needs critics that err
    independently. Critics that share data and target do not, so the fused deviation is too
    small: never above the smallest sigma_i, and sigma / sqrt(n) when all agree on sigma.

    Weights are computed with logarithms, so that no square overflows or needs a floor of its own.

    Args:
        means: Critics' means, shape (n, B).
        stds: Critics' standard deviations, shape (n, B), positive.
    """
    stds = stds.clamp_min(MIN_STD)
    weights = stds.log().mul(-2.0).softmax(dim=0)
    # w_i sigma_i^2 is the fused variance for every i; the surest critic's is the one to take,
    # since its weight, at least 1 / n, does not underflow.
    std = stds.amin(dim=0) * weights.amax(dim=0).sqrt()
    return Fused((weights * means).sum(dim=0), std, weights)


def log_pool(means: th.Tensor, stds: th.Tensor) -> Fused:
    """Logarithmic opinion pool: the geometric mean of the critics' densities.

    Not in the paper; chosen because it has the mean of `product` while critics that agree on
    sigma keep it, so sigma stays the deviation of the return.

    Args:
        means: Critics' means, shape (n, B).
        stds: Critics' standard deviations, shape (n, B), positive.
    """
    fused = product(means, stds)
    return fused._replace(std=fused.std * len(means) ** 0.5)


def minimum(means: th.Tensor, stds: th.Tensor) -> Fused:
    """The whole distribution of the critic with the smallest mean (DSAC-T).

    Args:
        means: Critics' means, shape (n, B).
        stds: Critics' standard deviations, shape (n, B), positive.
    """
    lowest = means.argmin(dim=0, keepdim=True)
    weights = th.zeros_like(means).scatter_(0, lowest, 1.0)
    return Fused(means.gather(0, lowest)[0], stds.gather(0, lowest)[0], weights)


FUSIONS: Final[Mapping[str, FusionRule]] = MappingProxyType(
    {"product": product, "log_pool": log_pool, "min": minimum}
)


def bounded_error(targets: th.Tensor, means: th.Tensor, bounds: th.Tensor) -> th.Tensor:
    """Clip(target, Q - b, Q + b) - Q of each critic (paper, `eq6`, its clipped target).

    Args:
        targets: Sampled target returns, shape (B,).
        means: Critics' means Q, shape (n, B).
        bounds: Bound b of each critic, shape (n,), in units of return.

    Returns:
        Errors within the bound, one row a critic, shape (n, B).
    """
    limits = bounds[:, None]
    return (targets - means).clamp(-limits, limits)


def weight_entropy(weights: th.Tensor) -> th.Tensor:
    """Mean entropy of fusion weights in nats: 0 if one critic decides, log n if all do alike.

    Args:
        weights: Shares of the critics, shape (n, B).
    """
    entropies: th.Tensor = th.special.entr(weights).sum(dim=0)
    return entropies.mean()
