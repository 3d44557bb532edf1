"""Stops training at NaN and infinity before they reach a weight."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import torch as th

from sb3_bayes_dsac.common.minibatches import Batch
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
    inputs = [name for name, part in _parts(batch) if not part.isfinite().all()]
    cure = (
        "The environment or the replay buffer gave them; gymnasium's PassiveEnvChecker and SB3's "
        "VecCheckNan find where."
        if inputs
        else "The batch is finite, so training diverged: lower learning_rate, scale the rewards "
        "down, or try layer_norm."
    )
    raise NotFiniteError([*inputs, *bad], step, cure)


def _parts(
    batch: Batch,
) -> Iterator[tuple[str, th.Tensor]]:
    """All tensors of a batch by name."""
    for name, part in batch._asdict().items():
        if isinstance(part, dict):
            yield from ((f"{name}[{key!r}]", tensor) for key, tensor in part.items())
        elif part is not None:
            yield name, part
