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

    def rows(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """G, shape (m, 9), and h, shape (m,), m/s; m is the same at every tick."""

    def names(self) -> tuple[str, ...]:
        """What each of the m rows stands for."""


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

    def rows(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Rows`."""
        found = self._witnesses(tick)
        gain = min(self._gain, 1.0 / tick.dt)
        G, h = _barrier(
            found.gradient, found.distance, self._margin, gain, tick.limits.braking, tick.dt
        )
        return G, h


PUSH_OUT_SPEED = 0.3  # m/s; not in the paper, fits into the limits of every joint


@numba.njit(cache=True)
def allowed_approach(clearance: FloatArray, gain: float, braking: float, dt: float) -> FloatArray:
    """Greatest speed towards a point with this much room left [m/s].

    The least of the barrier's gain * clearance and of the speed from which the brakes still stop
    within the clearance after one more step: v dt + v^2 / (2 a) = clearance.

    Args:
        clearance: Distance less the margin, shape (m,), m; negative inside the margin.
        gain: Barrier gain [1/s].
        braking: Deceleration that can be counted on [m/s^2]; inf for none.
        dt: Duration of a step [s].
    """
    speed = np.empty_like(clearance)
    lag = braking * dt
    for i, room in enumerate(clearance):
        speed[i] = max(gain * room, -PUSH_OUT_SPEED)
        if room > 0.0 and np.isfinite(lag):
            speed[i] = min(speed[i], np.sqrt(lag**2 + 2.0 * braking * room) - lag)
    return speed


@numba.njit(cache=True)
def silence(G: FloatArray, h: FloatArray) -> None:
    """Turn rows that can say nothing into rows that always hold, in place.

    Args:
        G: Rows, shape (m, 9).
        h: Right-hand sides, shape (m,); not finite where there is no point.
    """
    for i in range(len(h)):
        active = False
        for j in range(G.shape[1]):
            active = active or abs(G[i, j]) >= _LEAST_GRADIENT
        if not (active and np.isfinite(h[i])):
            G[i], h[i] = 0.0, INACTIVE


@numba.njit(cache=True)
def _barrier(
    gradient: FloatArray,
    distance: FloatArray,
    margin: float,
    gain: float,
    braking: float,
    dt: float,
) -> tuple[FloatArray, FloatArray]:
    """Rows (B * K, 9) and (B * K,) of witness points with gradients (B, K, 9)."""
    n_bodies, count, n = gradient.shape
    G, clearance = np.empty((n_bodies * count, n)), np.empty(n_bodies * count)
    for b in range(n_bodies):
        for k in range(count):
            clearance[b * count + k] = distance[b, k] - margin
            for j in range(n):
                G[b * count + k, j] = -gradient[b, k, j]
    h = allowed_approach(clearance, gain, braking, dt)
    silence(G, h)
    return G, h
