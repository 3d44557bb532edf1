"""Processor time of one call: what other programs on the same core take does not count."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


def timed(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> tuple[T, float]:
    """What a call gives, and the microseconds of this thread that it takes."""
    begin = time.thread_time_ns()
    result = function(*args, **kwargs)
    return result, 1e-3 * (time.thread_time_ns() - begin)
