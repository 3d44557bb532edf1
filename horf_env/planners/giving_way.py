"""Notices a base that can neither drive nor turn, and for how long it then gives way.

An obstacle at a corner of the front stops both: a turn away from it moves the corner ahead, too.
Backwards both are free.
"""

from __future__ import annotations

from horf_env.types import FloatArray

_STILL, _TURNING = 0.05, 0.1  # m/s, rad/s
_HELD, _STEPS = 10, 16  # steps


class GivingWay:
    """Counts steps without motion, then those of giving way."""

    def __init__(self) -> None:
        """Nothing holds the base."""
        self._held = self._left = 0

    def update(self, speed: float, velocity: FloatArray) -> bool:
        """Take in one step; whether to give way now.

        Args:
            speed: That the base is to drive at [m/s]; 0 for a turn on the spot.
            velocity: Of the base in the last step, shape (2,), m/s and rad/s.
        """
        turns = speed < _STILL and abs(velocity[1]) > _TURNING
        self._held = 0 if abs(velocity[0]) > _STILL or turns else self._held + 1
        if self._held == _HELD:
            self._held, self._left = 0, _STEPS
        self._left -= 1
        return self._left >= 0
