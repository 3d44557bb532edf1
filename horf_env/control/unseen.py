"""Rows that keep the base from driving, reversing or swinging into ground nobody has looked at.

Not in the paper. Most of what a base with a forward camera hits with a good map is behind it or
beside it. Unseen ground is no obstacle as such: only within the stopping distance it limits the
speed, and only that of the base.
"""

from __future__ import annotations

import numba
import numpy as np

from horf_env.control.avoidance import allowed_approach, silence
from horf_env.control.tick import ControlTick
from horf_env.robot.footprint import FOOTPRINT
from horf_env.types import FloatArray

# Directions around the base, each with one row for its nearest unseen place: four sides and four
# corners, and one more between each two of them.
_SECTORS = 16
_LOWER, _UPPER = np.array(FOOTPRINT[::2]), np.array(FOOTPRINT[1::2])
_TOUCHING = 1e-6  # m; nearer to the footprint a place has no direction


# The gripper as a disc around the point between its finger tips [m]: half of the hand's width.
_HAND_RADIUS = 0.11


class UnseenGround:
    """One row for the nearest unseen place in each direction around the base."""

    def __init__(self, *, gain: float, margin: float) -> None:
        """Set the barrier.

        Args:
            gain: Barrier gain [1/s].
            margin: Distance from the middle of an unseen place that is kept [m].
        """
        self._gain, self._margin = gain, margin
        self._names = tuple(f"unseen ground {k}" for k in range(_SECTORS))

    def names(self) -> tuple[str, ...]:
        """See `Rows`."""
        return self._names

    def rows(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Rows`."""
        G, distance = _nearest_rows(tick.unseen, tick.state.T_world_base, _LOWER, _UPPER)
        return G, _held(G, distance - self._margin, self._gain, tick)


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
        sector = int((np.arctan2(y, x) / (2.0 * np.pi) + 1.0) * _SECTORS) % _SECTORS
        if _TOUCHING < distance < nearest[sector]:
            nearest[sector] = distance
            # A point of the base moves with (v - omega y, omega x).
            G[sector, 0] = away_x / distance
            G[sector, 1] = (away_y * x - away_x * y) / distance
    return G, nearest


class UnseenReach:
    """One row for the nearest unseen place in each direction around the gripper.

    An arm that swings aside leads the camera: without these rows the hand hits what stands where
    nobody has looked yet. The places are those of the ground, for want of a better guess.
    """

    def __init__(self, *, gain: float, margin: float) -> None:
        """Set the barrier.

        Args:
            gain: Barrier gain [1/s].
            margin: Distance from the middle of an unseen place that is kept [m].
        """
        self._gain, self._margin = gain, margin
        self._names = tuple(f"unseen reach {k}" for k in range(_SECTORS))

    def names(self) -> tuple[str, ...]:
        """See `Rows`."""
        return self._names

    def rows(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        """See `Rows`."""
        state = tick.state
        J = state.T_world_base[:2, :2] @ state.ee_jacobian[:2]
        G, distance = _reach_rows(tick.unseen, state.T_world_ee[:2, 3].copy(), J)
        return G, _held(G, distance - self._margin, self._gain, tick)


def _held(G: FloatArray, clearance: FloatArray, gain: float, tick: ControlTick) -> FloatArray:
    """Right-hand sides: nearer than the margin a body may stay; it need not back off."""
    gain = min(gain, 1.0 / tick.dt)
    h = allowed_approach(clearance, gain=gain, braking=tick.limits.braking, dt=tick.dt)
    np.maximum(h, 0.0, out=h)
    silence(G, h)
    return np.asarray(h)


@numba.njit(cache=True)
def _reach_rows(
    places: FloatArray, gripper: FloatArray, J: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rows (16, 9) that give the gripper's approach to the nearest place of each sector.

    Args:
        places: In the world, shape (M, 2), m.
        gripper: Position of the gripper in the world, shape (2,), m.
        J: Its velocity in the world for each velocity, shape (2, 9).
    """
    G, nearest = np.zeros((_SECTORS, 9)), np.full(_SECTORS, np.inf)
    for i in range(len(places)):
        dx, dy = places[i, 0] - gripper[0], places[i, 1] - gripper[1]
        distance = np.sqrt(dx * dx + dy * dy)
        sector = int((np.arctan2(dy, dx) / (2.0 * np.pi) + 1.0) * _SECTORS) % _SECTORS
        if _TOUCHING < distance < nearest[sector]:
            nearest[sector] = distance
            G[sector] = (dx * J[0] + dy * J[1]) / distance
    return G, nearest - _HAND_RADIUS
