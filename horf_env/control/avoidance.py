"""Avoidance rows: how fast a body may come closer to a witness point (A_avoi, B_avoi)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numba
import numpy as np

from horf_env.control.tick import ControlTick
from horf_env.sdf import Witnesses
from horf_env.types import FloatArray

# Below this length a gradient says nothing: no velocity changes the distance.
_LEAST_GRADIENT = 1e-6
# Right-hand side of a row that says nothing. Not 0: PIQP calls rows of zeros <= 0 infeasible.
INACTIVE = 1.0


class Rows(Protocol):
    """Linear rows G velocity <= h, all softened by the shared slack."""

    def names(self) -> tuple[str, ...]:
        """What each of the m rows stands for; m is the same at every tick."""

    def fill(self, tick: ControlTick, rows: FloatArray) -> None:
        """Write (G, h) into memory as it comes, shape (m, 10); h in m/s."""


class Avoidance:
    """One row for each witness point of each body: -gradient . velocity <= allowed approach.

    The paper allows (distance - psi) in m where m/s is needed; read with a gain of 1/s. The allowed
    approach is also capped by what the brakes can still stop, and the speed at which a body is
    pushed out of the margin is capped (both not in the paper).
    """

    def __init__(
        self,
        witnesses: Callable[[ControlTick], Witnesses],
        *,
        label: str,
        bodies: tuple[str, ...],
        count: int,
        gain: float,
        margin: float,
    ) -> None:
        """Set the barrier.

        Args:
            witnesses: Takes the witness points from the tick.
            label: What is avoided.
            bodies: Names of the nine bodies.
            count: Witness points a body.
            gain: Barrier gain alpha [1/s]; capped at 1/dt, where a step could overshoot.
            margin: Distance psi that is kept [m].
        """
        self._witnesses = witnesses
        self._names = tuple(f"{label} {body} {k}" for body in bodies for k in range(count))
        self._gain, self._margin = gain, margin

    def names(self) -> tuple[str, ...]:
        """See `Rows`."""
        return self._names

    def fill(self, tick: ControlTick, rows: FloatArray) -> None:
        """See `Rows`."""
        found = self._witnesses(tick)
        _barrier(
            rows,
            found.gradient,
            found.distance,
            self._margin,
            self._gain,
            tick.limits.braking,
            tick.dt,
        )


PUSH_OUT_SPEED = 0.3  # m/s; not in the paper, fits into the limits of every joint


@numba.njit(cache=True)
def allowed_approach(room: float, gain: float, braking: float, dt: float) -> float:
    """Greatest speed towards a point with this much room left [m/s].

    The least of the barrier's gain * room and of the speed from which the brakes still stop within
    the room after one more step: v dt + v^2 / (2 a) = room.

    Args:
        room: Distance less the margin [m]; negative inside the margin.
        gain: Barrier gain [1/s]; capped at 1/dt, where a step could overshoot.
        braking: Deceleration that can be counted on [m/s^2]; inf for none.
        dt: Duration of a step [s].
    """
    speed = max(min(gain, 1.0 / dt) * room, -PUSH_OUT_SPEED)
    lag = braking * dt
    if room > 0.0 and np.isfinite(lag):
        speed = min(speed, np.sqrt(lag**2 + 2.0 * braking * room) - lag)
    return speed


@numba.njit(cache=True)
def silence(rows: FloatArray) -> None:
    """Turn rows that can say nothing into rows that always hold, in place.

    Args:
        rows: (G, h), shape (m, 10); h is not finite where there is no point.
    """
    for i in range(len(rows)):
        active = False
        for j in range(9):
            active = active or abs(rows[i, j]) >= _LEAST_GRADIENT
        if not (active and np.isfinite(rows[i, 9])):
            for j in range(9):
                rows[i, j] = 0.0
            rows[i, 9] = INACTIVE


@numba.njit(cache=True)
def _barrier(
    rows: FloatArray,
    gradient: FloatArray,
    distance: FloatArray,
    margin: float,
    gain: float,
    braking: float,
    dt: float,
) -> None:
    """Rows (B * K, 10) of witness points with gradients (B, K, 9)."""
    n_bodies, count, n = gradient.shape
    for b in range(n_bodies):
        for k in range(count):
            row = rows[b * count + k]
            for j in range(n):
                row[j] = -gradient[b, k, j]
            row[n] = allowed_approach(distance[b, k] - margin, gain, braking, dt)
    silence(rows)
