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
_TOUCHING = 1e-6  # m; nearer to the footprint a place has no direction
# The gripper as a disc around the point between its finger tips [m]: half of the hand's width.
_HAND_RADIUS = 0.11

_Barrier = tuple[float, float, float, float]
"""Margin [m], gain [1/s], braking [m/s^2] and duration of a step [s]."""


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

    def rows(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Rows`."""
        gain = min(self._gain, 1.0 / tick.dt)
        return self._rows(tick, (self._margin, gain, tick.limits.braking, tick.dt))

    @abstractmethod
    def _rows(self, tick: ControlTick, barrier: _Barrier) -> tuple[FloatArray, FloatArray]:
        """Rows (16, 9), (16,) of the approach to each direction's nearest place."""


class UnseenGround(_UnseenRows):
    """Rows of the base."""

    label = "ground"

    def _rows(self, tick: ControlTick, barrier: _Barrier) -> tuple[FloatArray, FloatArray]:
        G, h = _ground_rows(tick.unseen, tick.state.T_world_base, FOOTPRINT, barrier)
        return G, h


class UnseenReach(_UnseenRows):
    """Rows of the gripper.

    An arm that swings aside leads the camera: without these rows the hand hits what stands where
    nobody has looked yet. The places are those of the ground, for want of a better guess.
    """

    label = "reach"

    def _rows(self, tick: ControlTick, barrier: _Barrier) -> tuple[FloatArray, FloatArray]:
        state = tick.state
        J = state.T_world_base[:2, :2] @ state.ee_jacobian[:2]
        G, h = _reach_rows(tick.unseen, state.T_world_ee, J, barrier)
        return G, h


@numba.njit(cache=True)
def _ground_rows(
    places: FloatArray,
    T_world_base: FloatArray,
    footprint: tuple[float, float, float, float],
    barrier: _Barrier,
) -> tuple[FloatArray, FloatArray]:
    """Rows (16, 9), (16,) of the base's approach to the nearest place of each sector.

    Args:
        places: In the world, shape (M, 2), m.
        T_world_base: Pose of the base, shape (4, 4).
        footprint: See `FOOTPRINT`.
        barrier: See `_Barrier`.
    """
    G, nearest = np.zeros((_SECTORS, 9)), np.full(_SECTORS, np.inf)
    c, s = T_world_base[0, 0], T_world_base[1, 0]
    for i in range(len(places)):
        dx, dy = places[i, 0] - T_world_base[0, 3], places[i, 1] - T_world_base[1, 3]
        x, y = c * dx + s * dy, c * dy - s * dx
        away_x = x - min(max(x, footprint[0]), footprint[1])
        away_y = y - min(max(y, footprint[2]), footprint[3])
        distance = np.sqrt(away_x * away_x + away_y * away_y)
        sector = _sector(x, y)
        if _TOUCHING < distance < nearest[sector]:
            nearest[sector] = distance
            # A point of the base moves with (v - omega y, omega x).
            G[sector, 0] = away_x / distance
            G[sector, 1] = (away_y * x - away_x * y) / distance
    return G, _allowed(G, nearest, barrier)


@numba.njit(cache=True)
def _reach_rows(
    places: FloatArray, T_world_ee: FloatArray, J: FloatArray, barrier: _Barrier
) -> tuple[FloatArray, FloatArray]:
    """Rows (16, 9), (16,) of the gripper's approach to the nearest place of each sector.

    Args:
        places: In the world, shape (M, 2), m.
        T_world_ee: Pose of the gripper, shape (4, 4).
        J: Its velocity in the world for each velocity, shape (2, 9).
        barrier: See `_Barrier`.
    """
    G, nearest = np.zeros((_SECTORS, 9)), np.full(_SECTORS, np.inf)
    for i in range(len(places)):
        dx, dy = places[i, 0] - T_world_ee[0, 3], places[i, 1] - T_world_ee[1, 3]
        distance = np.sqrt(dx * dx + dy * dy)
        sector = _sector(dx, dy)
        if _TOUCHING < distance < nearest[sector]:
            nearest[sector] = distance
            for j in range(J.shape[1]):
                G[sector, j] = (dx * J[0, j] + dy * J[1, j]) / distance
    return G, _allowed(G, nearest - _HAND_RADIUS, barrier)


@numba.njit(cache=True)
def _allowed(G: FloatArray, distance: FloatArray, barrier: _Barrier) -> FloatArray:
    """Right-hand sides; rows that say nothing are silenced.

    Nearer than the margin the robot may stay; it need not back off.
    """
    margin, gain, braking, dt = barrier
    h = np.maximum(allowed_approach(distance - margin, gain, braking, dt), 0.0)
    silence(G, h)
    return h


@numba.njit(cache=True)
def _sector(x: float, y: float) -> int:
    """Number of the direction in which (x, y) lies."""
    return int((np.arctan2(y, x) / (2.0 * np.pi) + 1.0) * _SECTORS) % _SECTORS
