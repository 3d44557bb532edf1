"""Notices that a motion gets no further."""

from __future__ import annotations

_LEAST_PROGRESS = 0.02  # m or rad
_STILL, _STILL_STEPS = 0.05, 20  # m/s and rad/s


class Patience:
    """Exhausted when what is left to do has not become less for a number of steps.

    Or when nothing has moved for 20 steps.
    """

    def __init__(self, steps: int) -> None:
        """Start anew.

        Args:
            steps: That it waits.
        """
        self._steps, self._left, self._best = steps, steps, float("inf")
        self._still = 0

    def exhausted(self, to_go: float, speed: float) -> bool:
        """Take in one step.

        Args:
            to_go: What is left to do [m or rad].
            speed: Of what moves [m/s and rad/s].
        """
        self._left -= 1
        self._still = self._still + 1 if speed < _STILL else 0
        if self._still >= _STILL_STEPS:
            return True
        if to_go < self._best - _LEAST_PROGRESS:
            self._best, self._left = to_go, self._steps
        return self._left <= 0
