"""Refuses configurations that no joint can have."""

from __future__ import annotations

from collections.abc import Sequence
from operator import le

from horf_env.errors import ConfigurationError

_SLACK = 1e-9  # rad or m; rounding of a configuration at its limit


def within(values: Sequence[float], lower: Sequence[float], upper: Sequence[float]) -> bool:
    """Whether all values are within their limits; what is not a number is not."""
    return all(map(le, lower, values)) and all(map(le, values, upper))


def check_limits(
    values: Sequence[float], lower: Sequence[float], upper: Sequence[float], names: Sequence[str]
) -> None:
    """Refuse a configuration outside of its limits.

    Args:
        values: The configuration, rad or m.
        lower: Least value of each joint.
        upper: Greatest value of each joint.
        names: Names of the joints.

    Raises:
        ConfigurationError: If a joint is outside, with its name.
    """
    for name, value, low, high in zip(names, values, lower, upper, strict=True):
        if not low - _SLACK <= value <= high + _SLACK:
            raise ConfigurationError(
                f"joint {name!r}: {value:.6g} is outside of its limits [{low:.6g}, {high:.6g}]; "
                "clip the configuration first"
            )
