"""Where the seconds of a run go."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from .run_state import Times


class Clock:
    """Seconds of a run over all of its sessions.

    Args:
        before: Seconds of the sessions before.
    """

    def __init__(self, before: Times) -> None:
        self._times, self._last = before, time.perf_counter()

    def read(self, environment: float = 0.0) -> Times:
        """Until now.

        Args:
            environment: Seconds of environments that were not added yet.
        """
        now = time.perf_counter()
        self._times = replace(self._times, total=self._times.total + now - self._last)
        self._last = now
        return replace(self._times, environment=self._times.environment + environment)

    def add(self, name: str, seconds: float) -> None:
        """Count seconds as those of one of the parts of `Times`."""
        self._times = replace(self._times, **{name: getattr(self._times, name) + seconds})

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Count the time of a block as that of a part."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.add(name, time.perf_counter() - begin)
