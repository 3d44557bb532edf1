"""Checks of settings: a margin of NaN would switch all avoidance off without a word."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from numbers import Integral, Real

from horf_env.errors import SettingError


def check_counts(settings: object, *names: str) -> None:
    """Refuse what is no whole number from 1 on.

    Args:
        settings: Has the attributes that are named.
        names: Which of them to look at.

    Raises:
        SettingError: If one of them is something else.
    """
    for name in names:
        value = getattr(settings, name)
        if not isinstance(value, Integral) or value < 1:
            raise SettingError(name, value, "a whole number from 1 on")


def check_positive(settings: object, *names: str) -> None:
    """Refuse what is no finite number above 0; see `check_counts`."""
    _check(settings, names, operator.gt, "a finite number above 0")


def check_not_negative(settings: object, *names: str) -> None:
    """Refuse what is no finite number from 0 on; see `check_counts`."""
    _check(settings, names, operator.ge, "a finite number from 0 on")


def check_unbounded(settings: object, *names: str) -> None:
    """Refuse what is no number from 0 on, inf included; see `check_counts`."""
    for name in names:
        value = getattr(settings, name)
        if value != math.inf:
            _check(settings, (name,), operator.ge, "a number from 0 on, or inf")


def _check(
    settings: object, names: tuple[str, ...], holds: Callable[[float, float], bool], expected: str
) -> None:
    for name in names:
        value = getattr(settings, name)
        if not isinstance(value, Real) or not math.isfinite(value) or not holds(float(value), 0.0):
            raise SettingError(name, value, expected)
