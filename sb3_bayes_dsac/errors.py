"""Errors of this package: each names the argument, its value and the cure."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from numbers import Integral
from typing import TypeVar

T = TypeVar("T")


class BayesDsacError(Exception):
    """Root of all errors that `sb3_bayes_dsac` raises on purpose."""


class ArgumentError(BayesDsacError, ValueError):
    """An argument that no algorithm of this package can work with.

    Attributes:
        argument: Name of the argument.
        value: What was given.
        cure: What to give instead.
    """

    def __init__(self, argument: str, value: object, cure: str) -> None:
        self.argument = argument
        self.value = value
        self.cure = cure
        super().__init__(f"{argument}={value!r}: {cure}")


class FrameStackError(BayesDsacError, ValueError):
    """Observations that are not what a buffer of frame stacks stores.

    Attributes:
        key: Key of the observation.
        env: Number of the environment.
    """

    def __init__(self, key: str, env: int) -> None:
        self.key = key
        self.env = env
        super().__init__(
            f"next_obs[{key!r}] of environment {env} is not obs[{key!r}] shifted by one frame "
            "along its first axis: stack single frames, newest last, leave this key out of "
            "stacked_keys, or use DictReplayBuffer"
        )


class NotFiniteError(BayesDsacError, ValueError):
    """Training met NaN or infinity and has stopped before it reached any weight.

    Attributes:
        what: Losses and parts of the batch that are not finite.
        step: Number of the gradient step, from 1.
    """

    def __init__(self, what: list[str], step: int, cure: str) -> None:
        self.what = what
        self.step = step
        super().__init__(
            f"{', '.join(what)} not finite in gradient step {step}; "
            f"the weights are those of step {step - 1}. {cure}"
        )


class UnsupportedSpaceError(ArgumentError, AssertionError):
    """A space that the algorithm cannot act in; an AssertionError too, as SB3 raises there."""


def require_count(argument: str, value: object) -> None:
    """Refuse what is not a whole number of at least 1.

    Args:
        argument: Name of the argument that carries the number, for the error.
        value: What was given.

    Raises:
        ArgumentError: It is none.
    """
    if not isinstance(value, Integral) or value < 1:
        raise ArgumentError(argument, value, "give a whole number, 1 or more")


def choose(argument: str, name: str, valid: Mapping[str, T]) -> T:
    """Look a name up among the valid ones.

    Args:
        argument: Name of the argument that carries the name, for the error.
        name: What was given.
        valid: All valid names with what they stand for.

    Returns:
        What the name stands for.

    Raises:
        ArgumentError: The name is not a valid one; lists the valid names, the nearest first.
    """
    if isinstance(name, str) and name in valid:
        return valid[name]
    near = difflib.get_close_matches(str(name), valid, n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise ArgumentError(argument, name, f"{hint}valid are {', '.join(map(repr, sorted(valid)))}")
