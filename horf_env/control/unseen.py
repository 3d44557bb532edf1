"""Rows that keep base and gripper from moving into ground nobody has looked at.

Not in the paper. Most of what a robot with a forward camera hits with a good map is behind it or
beside it. Unseen ground is no obstacle as such: only within the stopping distance it limits the
speed, and only that of the base and of the gripper.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numba
import numpy as np

from horf_env.control.avoidance import allowed_approach, silence
from horf_env.control.tick import ControlTick
from horf_env.robot.footprint import FOOTPRINT
from horf_env.types import FloatArray

# Directions around a body, each with one row for its nearest unseen place: four sides and four
# corners, and one more between each two of them.
_SECTORS = 16
_TAN_1, _TAN_3 = float(np.tan(np.pi / 8.0)), float(np.tan(3.0 * np.pi / 8.0))
_TOUCHING = 1e-6  # m; nearer to the footprint a place has no direction
# The gripper as a disc around the point between its finger tips [m]: half of the hand's width.
_HAND_RADIUS = 0.11


class _UnseenRows(ABC):
    """One row for the nearest unseen place in each direction."""

    label: ClassVar[str]

    def __init__(self, *, gain: float, margin: float) -> None:
        """Set the barrier.

        Args:
            gain: Barrier gain [1/s].
            margin: Distance from the middle of an unseen place that is kept [m].
        """
        self._gain, self._margin = gain, margin
        self._names = tuple(f"unseen {self.label} {k}" for k in range(_SECTORS))

    def names(self) -> tuple[str, ...]:
        """See `Rows`."""
        return self._names

    @abstractmethod
    def fill(self, tick: ControlTick, rows: FloatArray) -> None:
        """See `Rows`; rows of the approach to each direction's nearest place."""


class UnseenGround(_UnseenRows):
    """Rows of the base."""

    label = "ground"

    def fill(self, tick: ControlTick, rows: FloatArray) -> None:
        """See `Rows`."""
        _ground_rows(
            rows,
            tick.unseen,
            tick.state.T_world_base,
            self._margin,
            self._gain,
            tick.limits.braking,
            tick.dt,
        )


class UnseenReach(_UnseenRows):
    """Rows of the gripper.

    An arm that swings aside leads the camera: without these rows the hand hits what stands where
    nobody has looked yet. The places are those of the ground, for want of a better guess.
    """

    label = "reach"

    def fill(self, tick: ControlTick, rows: FloatArray) -> None:
        """See `Rows`."""
        state = tick.state
        _reach_rows(
            rows,
            tick.unseen,
            state.T_world_base,
            state.T_world_ee,
            state.ee_jacobian,
            self._margin + _HAND_RADIUS,
            self._gain,
            tick.limits.braking,
            tick.dt,
        )


@numba.njit(cache=True)
def _ground_rows(
    rows: FloatArray,
    places: FloatArray,
    T_world_base: FloatArray,
    margin: float,
    gain: float,
    braking: float,
    dt: float,
) -> None:
    """Rows (16, 10) of the base's approach to the nearest place of each sector.

    Args:
        rows: To be written.
        places: In the world, shape (M, 2), m.
        T_world_base: Pose of the base, shape (4, 4).
        margin: Distance that is kept [m].
        gain: Barrier gain [1/s].
        braking: See `allowed_approach`.
        dt: Duration of a step [s].
    """
    nearest = np.full(_SECTORS, np.inf)
    rows[:] = 0.0
    c, s = T_world_base[0, 0], T_world_base[1, 0]
    back, front, right, left = FOOTPRINT
    for i in range(len(places)):
        dx, dy = places[i, 0] - T_world_base[0, 3], places[i, 1] - T_world_base[1, 3]
        x, y = c * dx + s * dy, c * dy - s * dx
        away_x, away_y = x - min(max(x, back), front), y - min(max(y, right), left)
        squared, sector = away_x * away_x + away_y * away_y, _sector(x, y)
        if _TOUCHING**2 < squared < nearest[sector]:
            nearest[sector] = squared
            # A point of the base moves with (v - omega y, omega x).
            rows[sector, 0], rows[sector, 1] = away_x, away_y * x - away_x * y
    _allow(rows, nearest, margin, gain, braking, dt)


@numba.njit(cache=True)
def _reach_rows(
    rows: FloatArray,
    places: FloatArray,
    T_world_base: FloatArray,
    T_world_ee: FloatArray,
    ee_jacobian: FloatArray,
    margin: float,
    gain: float,
    braking: float,
    dt: float,
) -> None:
    """Rows (16, 10) of the gripper's approach to the nearest place of each sector.

    Args:
        rows: To be written.
        places: In the world, shape (M, 2), m.
        T_world_base: Pose of the base, shape (4, 4).
        T_world_ee: Pose of the gripper, shape (4, 4).
        ee_jacobian: Its twist in the axes of the base for each velocity, shape (6, 9).
        margin: Distance of its middle that is kept [m].
        gain: Barrier gain [1/s].
        braking: See `allowed_approach`.
        dt: Duration of a step [s].
    """
    nearest, towards = np.full(_SECTORS, np.inf), np.zeros((_SECTORS, 2))
    for i in range(len(places)):
        dx, dy = places[i, 0] - T_world_ee[0, 3], places[i, 1] - T_world_ee[1, 3]
        squared, sector = dx * dx + dy * dy, _sector(dx, dy)
        if _TOUCHING**2 < squared < nearest[sector]:
            nearest[sector], towards[sector, 0], towards[sector, 1] = squared, dx, dy
    c, s = T_world_base[0, 0], T_world_base[1, 0]
    for sector in range(_SECTORS):
        dx, dy = towards[sector]
        x, y = c * dx + s * dy, c * dy - s * dx
        for j in range(ee_jacobian.shape[1]):
            rows[sector, j] = x * ee_jacobian[0, j] + y * ee_jacobian[1, j]
    _allow(rows, nearest, margin, gain, braking, dt)


@numba.njit(cache=True)
def _allow(
    rows: FloatArray, squared: FloatArray, margin: float, gain: float, braking: float, dt: float
) -> None:
    """Divide rows by the distances whose squares are given, and write right-hand sides.

    Nearer than the margin the robot may stay; it need not back off.
    """
    for i in range(len(rows)):
        distance = np.sqrt(squared[i])
        for j in range(9):
            rows[i, j] /= distance
        rows[i, 9] = max(allowed_approach(distance - margin, gain, braking, dt), 0.0)
    silence(rows)


@numba.njit(cache=True)
def _sector(x: float, y: float) -> int:
    """Number of the direction in which (x, y) lies: 0 from the x axis on, to the left.

    By comparisons, for there are hundreds of places a tick and an arctangent is slow.
    """
    first = 0
    if y < 0.0 or (y == 0.0 and x < 0.0):
        first, x, y = 8, -x, -y
    if x <= 0.0:
        first, x, y = first + 4, y, -x
    return first + int(y >= _TAN_1 * x) + int(y >= x) + int(y >= _TAN_3 * x)
