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

_UNBOUNDED = np.array([[-np.inf] * 9, [np.inf] * 9])


class Bounds(Protocol):
    """Boxes around the velocity."""

    def narrow(self, tick: ControlTick, box: FloatArray) -> None:
        """Intersect a box with these: lower and upper bounds, shape (2, 9), m/s and rad/s.

        Args:
            tick: State of the robot.
            box: Changed in place, by `narrow_one`.
        """


class RobotBounds:
    """Bounds on speed, acceleration and turns, and joint dampers, the most binding first."""

    def __init__(self, *, gain: float, influence: float, stopping: float) -> None:
        """Set the dampers.

        Args:
            gain: Speed allowed at the influence distance [rad/s] (eta).
            influence: Distance from the limit at which the damper begins [rad] (rho_i).
            stopping: Distance from the limit at which the joint stops [rad] (rho_s).
        """
        self._slope = gain / (influence - stopping)
        self._influence, self._stopping = influence, stopping

    def narrow(self, tick: ControlTick, box: FloatArray) -> None:
        """See `Bounds`; one compiled call, for four would take longer to call than to run."""
        limits = tick.limits
        _narrow(
            box,
            tick.velocity,
            tick.state.configuration,
            limits.velocity,
            limits.acceleration,
            tick.dt,
            limits.lateral_acceleration,
            limits.arm_lower,
            limits.arm_upper,
            self._slope,
            self._influence,
            self._stopping,
        )


def combined_bounds(limits: Sequence[Bounds], tick: ControlTick) -> FloatArray:
    """Intersect boxes; where a later one leaves nothing, the earlier ones win.

    Returns:
        Lower and upper bound with lower <= upper, shape (2, 9).
    """
    box = _UNBOUNDED.copy()
    for limit in limits:
        limit.narrow(tick, box)
    return box


@numba.njit(cache=True)
def narrow_one(box: FloatArray, i: int, low: float, high: float) -> None:
    """Intersect the range of a velocity with another; what is left is never empty.

    Args:
        box: Lower and upper bounds, shape (2, 9); changed in place.
        i: Which velocity.
        low: Lower bound.
        high: Upper bound.
    """
    least, most = box[0, i], box[1, i]
    box[0, i] = min(max(low, least), most)
    box[1, i] = max(min(max(high, least), most), box[0, i])


@numba.njit(cache=True)
def limit_speed(box: FloatArray, fastest: FloatArray) -> None:
    """X- and X+ of the paper: |velocity| <= fastest, shape (9,)."""
    for i in range(9):
        narrow_one(box, i, -fastest[i], fastest[i])


@numba.njit(cache=True)
def limit_change(box: FloatArray, last: FloatArray, acceleration: FloatArray, dt: float) -> None:
    """|velocity - last| <= acceleration dt (not in the paper; real bases need it).

    Inside the QP, because clipping its answer afterwards breaks the avoidance rows.
    """
    for i in range(9):
        change = acceleration[i] * dt
        narrow_one(box, i, last[i] - change, last[i] + change)


@numba.njit(cache=True)
def limit_turn(box: FloatArray, last: FloatArray, lateral_acceleration: float) -> None:
    """|omega| <= a_lateral / |v| for the last forward speed v (not in the paper).

    A fast turn swings the robot towards what was beside it, faster than the base can brake.
    """
    if last[0] != 0.0:
        fastest = lateral_acceleration / abs(last[0])
        narrow_one(box, 1, -fastest, fastest)


@numba.njit(cache=True)
def damp_joints(
    box: FloatArray,
    configuration: FloatArray,
    arm_lower: FloatArray,
    arm_upper: FloatArray,
    slope: float,
    influence: float,
    stopping: float,
) -> None:
    """Velocity dampers at the arm's joint limits (B_damper of the paper).

    Towards a limit at distance rho: speed <= slope (rho - stopping) within the influence distance,
    slope = gain / (influence - stopping). Beyond the limit the bound changes sign and pulls the
    joint back. The paper prints a matrix of ones, which would couple all joints; read as one bound
    a joint and side. The base has no position limits, hence no dampers.
    """
    for j in range(len(arm_lower)):
        below, above = configuration[3 + j] - arm_lower[j], arm_upper[j] - configuration[3 + j]
        low = -((below - stopping) * slope) if below <= influence else -np.inf
        high = (above - stopping) * slope if above <= influence else np.inf
        narrow_one(box, 2 + j, low, high)


@numba.njit(cache=True)
def _narrow(
    box: FloatArray,
    last: FloatArray,
    configuration: FloatArray,
    fastest: FloatArray,
    acceleration: FloatArray,
    dt: float,
    lateral_acceleration: float,
    arm_lower: FloatArray,
    arm_upper: FloatArray,
    slope: float,
    influence: float,
    stopping: float,
) -> None:
    limit_speed(box, fastest)
    limit_change(box, last, acceleration, dt)
    limit_turn(box, last, lateral_acceleration)
    damp_joints(box, configuration, arm_lower, arm_upper, slope, influence, stopping)
