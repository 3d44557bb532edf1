"""How `ent_coef` and `target_entropy` are read: alpha in the return, and where it is led to."""

from __future__ import annotations

import math
from typing import NamedTuple

from gymnasium import spaces

from sb3_bayes_dsac.errors import ArgumentError


class Temperature(NamedTuple):
    """Entropy coefficient at the start of training.

    Attributes:
        initial: First value, in units of reward per nat.
        learned: Whether it follows the target entropy from there.
    """

    initial: float
    learned: bool


def parse_temperature(ent_coef: str | float) -> Temperature:
    """Read SB3's notation of an entropy coefficient.

    Args:
        ent_coef: "auto" (learned from 1.0), "auto_0.1" (learned from 0.1), or a constant.

    Raises:
        ArgumentError: None of these, or a start that is not positive (its logarithm is learned).
    """
    text = str(ent_coef)
    learned = text.startswith("auto")
    number = text.removeprefix("auto").removeprefix("_") if learned else text
    try:
        initial = float(number or 1.0)
    except ValueError:
        initial = math.nan
    if not (initial > 0.0 or (initial == 0.0 and not learned)):
        cure = 'give "auto", "auto_" with a positive start ("auto_0.1"), or a constant >= 0'
        raise ArgumentError("ent_coef", ent_coef, cure)
    return Temperature(initial, learned)


def parse_target_entropy(target_entropy: str | float, actions: spaces.Box) -> float:
    """Read SB3's notation of a target entropy.

    Args:
        target_entropy: "auto" (minus the number of actions), or a number of nats.
        actions: Action space.

    Raises:
        ArgumentError: None of these.
    """
    if target_entropy == "auto":
        return -float(math.prod(actions.shape))
    try:
        number = float(target_entropy)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise ArgumentError("target_entropy", target_entropy, 'give "auto" or a number of nats')
    return number
