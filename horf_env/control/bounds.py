"""Bounds on the velocity itself: speed, acceleration, joint limits. Each is a box, not a row.

A box cannot be infeasible, and PIQP calls feasible problems with all-zero rows infeasible.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numba
import numpy as np

from horf_env.control.tick import ControlTick
from horf_env.types import FloatArray


class Bounds(Protocol):
    """A box around the velocity."""

    def bounds(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bound, each of shape (9,), m/s and rad/s."""


class SpeedBounds:
    """X- and X+ of the paper: |velocity| <= limit."""

    def bounds(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Bounds`."""
        return -tick.limits.velocity, tick.limits.velocity


class AccelerationBounds:
    """|velocity - last velocity| <= acceleration dt (not in the paper; real bases need it).

    Inside the QP, because clipping its answer afterwards breaks the avoidance rows.
    """

    def bounds(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Bounds`."""
        change = tick.limits.acceleration * tick.dt
        return tick.velocity - change, tick.velocity + change


class LateralAccelerationBounds:
    """|omega| <= a_lateral / |v| for the last forward speed v (not in the paper).

    A fast turn swings the robot towards what was beside it, faster than the base can brake.
    """

    def bounds(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Bounds`."""
        upper = np.full(9, np.inf)
        speed = abs(tick.velocity[0])
        if speed > 0.0:
            upper[1] = tick.limits.lateral_acceleration / speed
        return -upper, upper


class JointDampers:
    """Velocity dampers at the arm's joint limits (B_damper of the paper).

    Towards a limit at distance rho: speed <= gain (rho - stopping) / (influence - stopping) within
    the influence distance. Beyond the limit the bound changes sign and pulls the joint back. The
    paper prints a matrix of ones, which would couple all joints; read as one bound a joint and
    side. The base has no position limits, hence no dampers.
    """

    def __init__(self, *, gain: float, influence: float, stopping: float) -> None:
        """Set the damper.

        Args:
            gain: Speed allowed at the influence distance [rad/s] (eta).
            influence: Distance from the limit at which the damper begins [rad] (rho_i).
            stopping: Distance from the limit at which the joint stops [rad] (rho_s).
        """
        self._gain, self._influence, self._stopping = gain, influence, stopping

    def bounds(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Bounds`."""
        return _damped(
            tick.state.configuration[3:],
            tick.limits.arm_lower,
            tick.limits.arm_upper,
            self._gain / (self._influence - self._stopping),
            self._influence,
            self._stopping,
        )


def combined_bounds(limits: Sequence[Bounds], tick: ControlTick) -> tuple[FloatArray, FloatArray]:
    """Intersect boxes; where a later one leaves nothing, the earlier ones win.

    Returns:
        Lower and upper bound with lower <= upper, each of shape (9,).
    """
    lower, upper = intersection(stacked_bounds(limits, tick))
    return lower, upper


def stacked_bounds(limits: Sequence[Bounds], tick: ControlTick) -> FloatArray:
    """Lower and upper bounds of all boxes in one array, shape (k * 18,)."""
    return np.concatenate([side for limit in limits for side in limit.bounds(tick)])


@numba.njit(cache=True)
def _damped(
    arm: FloatArray,
    arm_lower: FloatArray,
    arm_upper: FloatArray,
    slope: float,
    influence: float,
    stopping: float,
) -> tuple[FloatArray, FloatArray]:
    """Box (9,), (9,) of the dampers that speed up by `slope` [1/s] with the distance [rad]."""
    lower, upper = np.full(9, -np.inf), np.full(9, np.inf)
    for j in range(len(arm)):
        below, above = arm[j] - arm_lower[j], arm_upper[j] - arm[j]
        if below <= influence:
            lower[2 + j] = -((below - stopping) * slope)
        if above <= influence:
            upper[2 + j] = (above - stopping) * slope
    return lower, upper


@numba.njit(cache=True)
def intersection(boxes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Box (9,), (9,) within all boxes of `stacked_bounds`; see `combined_bounds`."""
    lower, upper = np.full(9, -np.inf), np.full(9, np.inf)
    for start in range(0, len(boxes), 18):
        for i in range(9):
            least, most = lower[i], upper[i]
            low, high = boxes[start + i], boxes[start + 9 + i]
            lower[i] = min(max(low, least), most)
            upper[i] = max(min(max(high, least), most), lower[i])
    return lower, upper
