"""Notices that a motion gets no further."""

from __future__ import annotations

_LEAST_PROGRESS = 0.02  # m or rad


class Patience:
    """Exhausted when what is left to do has not become less for a number of steps."""

    def __init__(self, steps: int) -> None:
        """Start anew.

        Args:
            steps: That it waits.
        """
        self._steps, self._left, self._best = steps, steps, float("inf")

    def exhausted(self, to_go: float) -> bool:
        """Take in one step.

        Args:
            to_go: What is left to do [m or rad].
        """
        self._left -= 1
        if to_go < self._best - _LEAST_PROGRESS:
            self._best, self._left = to_go, self._steps
        return self._left <= 0
