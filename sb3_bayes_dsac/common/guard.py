"""Stops training at NaN and infinity before they reach a weight."""

from __future__ import annotations

import math
from collections.abc import Mapping

import torch as th

from sb3_bayes_dsac.common.minibatches import Batch, named_tensors
from sb3_bayes_dsac.errors import NotFiniteError


def check_losses(
    losses: Mapping[str, th.Tensor],
    batch: Batch,
    step: int,
) -> None:
    """Look at each loss; only if one is bad, look for the cause in the batch.

    Any NaN or infinity in a batch reaches a loss, so the usual case costs one number a loss.

    Args:
        losses: Scalars by name.
        batch: What they were computed from.
        step: Number of the gradient step, from 1.

    Raises:
        NotFiniteError: A loss is NaN or infinite.
    """
    bad = [name for name, loss in losses.items() if not math.isfinite(loss.item())]
    if not bad:
        return
    inputs = [name for name, part in named_tensors(batch) if not part.isfinite().all()]
    cure = (
        "The environment or the replay buffer gave them; gymnasium's PassiveEnvChecker and SB3's "
        "VecCheckNan find where."
        if inputs
        else "The batch is finite, so training diverged: lower learning_rate, scale the rewards "
        "down, or try layer_norm."
    )
    raise NotFiniteError([*inputs, *bad], step, cure)
