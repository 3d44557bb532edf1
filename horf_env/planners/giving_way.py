"""Notices a base that can neither drive nor turn, and for how long it then gives way.

An obstacle at a corner of the front stops both: a turn away from it moves the corner ahead, too.
Backwards both are free, unless something is there, too: the elbow of a tucked arm reaches back.
"""

from __future__ import annotations

from horf_env.types import FloatArray

_STILL, _TURNING = 0.05, 0.1  # m/s, rad/s
_HELD, _STEPS = 10, 16  # steps
_BACK, _AHEAD = -1.0, 1.0


class GivingWay:
    """Counts steps without motion, then those of giving way: back, or ahead where that fails."""

    def __init__(self) -> None:
        """Nothing holds the base."""
        self._held = self._left = 0
        self._direction = _BACK

    def update(self, speed: float, velocity: FloatArray) -> float:
        """Take in one step.

        Args:
            speed: That the base is to drive at [m/s]; 0 for a turn on the spot.
            velocity: Of the base in the last step, shape (2,), m/s and rad/s.

        Returns:
            -1 to give way backwards now, 1 ahead, 0 not to.
        """
        turns = speed < _STILL and abs(velocity[1]) > _TURNING
        self._held = 0 if abs(velocity[0]) > _STILL or turns else self._held + 1
        if self._held == _HELD:
            self._held = 0
            self._change()
        self._left -= 1
        return self._direction if self._left >= 0 else 0.0

    def _change(self) -> None:
        """Begin to give way, try the other direction, or end."""
        gives_way = self._left > 0
        self._left = 0 if gives_way and self._direction == _AHEAD else _STEPS
        self._direction = _AHEAD if gives_way else _BACK
