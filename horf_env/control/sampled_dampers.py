"""Velocity dampers at sampled points of the robot's surface, in the form of NEO."""

from __future__ import annotations

from collections.abc import Callable

from horf_env.control.avoidance import silence
from horf_env.control.tick import ControlTick
from horf_env.sdf import Witnesses
from horf_env.types import FloatArray


class SampledDampers:
    """normal . J_point velocity <= gain (distance - stopping) / (influence - stopping).

    Haviland and Corke 2021 (NEO), with the paper's 40 points in place of collision shapes. The
    Jacobian is that of the sampled point in the axes of the normal; the toolbox that NEO ships with
    multiplies a normal in world axes with a Jacobian in the axes of the link, which is why its
    published code is not the source here.
    """

    def __init__(
        self,
        witnesses: Callable[[ControlTick], Witnesses],
        *,
        bodies: tuple[str, ...],
        count: int,
        gain: float,
        influence: float,
        stopping: float,
    ) -> None:
        """Set the damper.

        Args:
            witnesses: Takes the sampled points' nearest obstacle points from the tick.
            bodies: Names of the nine bodies.
            count: Most points of a body.
            gain: Speed allowed at the influence distance [m/s] (xi).
            influence: Distance at which the damper begins [m] (d_i).
            stopping: Distance at which the point stops [m] (d_s).
        """
        self._witnesses = witnesses
        self._names = tuple(f"sample {body} {k}" for body in bodies for k in range(count))
        self._gain, self._influence, self._stopping = gain, influence, stopping

    def names(self) -> tuple[str, ...]:
        """See `Rows`."""
        return self._names

    def fill(self, tick: ControlTick, rows: FloatArray) -> None:
        """See `Rows`."""
        found = self._witnesses(tick)
        distance = found.distance.ravel()
        rows[:, :9] = -found.gradient.reshape(-1, 9)
        rows[:, 9] = self._gain * (distance - self._stopping) / (self._influence - self._stopping)
        rows[distance > self._influence, 9] = float("inf")
        silence(rows)
