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
_LOWER, _UPPER = np.array(FOOTPRINT[::2]), np.array(FOOTPRINT[1::2])
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

    def rows(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Rows`."""
        G, distance = self._nearest(tick)
        h = allowed_approach(
            distance - self._margin,
            gain=min(self._gain, 1.0 / tick.dt),
            braking=tick.limits.braking,
            dt=tick.dt,
        )
        # Nearer than the margin it may stay; it need not back off.
        np.maximum(h, 0.0, out=h)
        silence(G, h)
        return G, h

    @abstractmethod
    def _nearest(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """Rows (16, 9) of the approach to each direction's nearest place, and its distance."""


class UnseenGround(_UnseenRows):
    """Rows of the base."""

    label = "ground"

    def _nearest(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        G, distance = _nearest_rows(tick.unseen, tick.state.T_world_base, _LOWER, _UPPER)
        return G, distance


class UnseenReach(_UnseenRows):
    """Rows of the gripper.

    An arm that swings aside leads the camera: without these rows the hand hits what stands where
    nobody has looked yet. The places are those of the ground, for want of a better guess.
    """

    label = "reach"

    def _nearest(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        state = tick.state
        J = state.T_world_base[:2, :2] @ state.ee_jacobian[:2]
        G, distance = _reach_rows(tick.unseen, state.T_world_ee, J)
        return G, distance


@numba.njit(cache=True)
def _nearest_rows(
    places: FloatArray, T_world_base: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rows (16, 9) that give the approach to the nearest place of each sector, and its distance.

    Args:
        places: In the world, shape (M, 2), m.
        T_world_base: Pose of the base, shape (4, 4).
        lower: Least x and y of the footprint, shape (2,), m.
        upper: Greatest x and y of the footprint, shape (2,), m.
    """
    G, nearest = np.zeros((_SECTORS, 9)), np.full(_SECTORS, np.inf)
    c, s = T_world_base[0, 0], T_world_base[1, 0]
    for i in range(len(places)):
        dx, dy = places[i, 0] - T_world_base[0, 3], places[i, 1] - T_world_base[1, 3]
        x, y = c * dx + s * dy, c * dy - s * dx
        away_x = x - min(max(x, lower[0]), upper[0])
        away_y = y - min(max(y, lower[1]), upper[1])
        distance = np.sqrt(away_x * away_x + away_y * away_y)
        sector = _sector(x, y)
        if _TOUCHING < distance < nearest[sector]:
            nearest[sector] = distance
            # A point of the base moves with (v - omega y, omega x).
            G[sector, 0] = away_x / distance
            G[sector, 1] = (away_y * x - away_x * y) / distance
    return G, nearest


@numba.njit(cache=True)
def _reach_rows(
    places: FloatArray, T_world_ee: FloatArray, J: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rows (16, 9) that give the gripper's approach to the nearest place of each sector.

    Args:
        places: In the world, shape (M, 2), m.
        T_world_ee: Pose of the gripper, shape (4, 4).
        J: Its velocity in the world for each velocity, shape (2, 9).
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
    return G, nearest - _HAND_RADIUS


@numba.njit(cache=True)
def _sector(x: float, y: float) -> int:
    """Number of the direction in which (x, y) lies."""
    return int((np.arctan2(y, x) / (2.0 * np.pi) + 1.0) * _SECTORS) % _SECTORS
