"""What of a motion of the base the QP would let through, so that nobody asks for more.

Asked for more the QP chooses for itself: a turn towards an obstacle takes the corner of the base
back, which allows more speed for a moment, and then the base is wedged. A twist of the gripper does
not say what the base does.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.control import ControlPreset
from horf_env.control.avoidance import allowed_approach
from horf_env.robot.footprint import FOOTPRINT, GUARDED_HEIGHT
from horf_env.task import STEP
from horf_env.types import FloatArray

_MARGIN, _GAIN = ControlPreset.margin, ControlPreset.gain
_NEAR = 1.5  # m; what is farther from the middle of the base allows everything
_TOUCHING = 1e-6  # m; no direction is away from a point that is so near
_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)


def allowed_motion(
    points: FloatArray, T_world_base: FloatArray, speed: float, turn: float, braking: float
) -> tuple[float, float]:
    """The same turn at a speed that is allowed with it, or less of the turn where there is none.

    A point at distance d, in direction n from the nearest point r of the base's outline, allows
    n_x v + (r_x n_y - r_y n_x) w up to `allowed_approach(d - margin)`.

    Args:
        points: Known obstacle points in the world, shape (N, 3), m.
        T_world_base: Pose of the base, shape (4, 4).
        speed: Asked for [m/s].
        turn: Asked for [rad/s].
        braking: Deceleration of the base that can be counted on [m/s^2].

    Returns:
        Speed between 0 and the one asked for [m/s], and turn [rad/s]; both as they were asked for
        where nothing is allowed, not even to stand: then the QP pushes the base out.
    """
    low = points[points[:, 2] < GUARDED_HEIGHT]
    near = ((low - T_world_base[:3, 3]) @ T_world_base[:3, :3])[:, :2]
    near = near[(np.abs(near) < _NEAR).all(axis=1)]
    rows = _rows(near, FOOTPRINT, _MARGIN, _GAIN, braking, STEP)
    for share in _SHARES:
        least, most = _range(rows, share * turn)
        low_speed, high_speed = max(least, min(speed, 0.0)), min(most, max(speed, 0.0))
        if low_speed <= high_speed:
            return float(np.clip(speed, low_speed, high_speed)), share * turn
    return speed, turn


@njit(cache=True)
def _rows(
    points: FloatArray,
    outline: tuple[float, float, float, float],
    margin: float,
    gain: float,
    braking: float,
    dt: float,
) -> FloatArray:
    """(for each m/s, for each rad/s, allowed) of points (N, 2) in the frame of the base."""
    rows, count = np.empty((len(points), 3)), 0
    for k in range(len(points)):
        x, y = points[k]
        r_x = min(max(x, outline[0]), outline[1])
        r_y = min(max(y, outline[2]), outline[3])
        distance = np.hypot(x - r_x, y - r_y)
        if distance > _TOUCHING:
            n_x, n_y = (x - r_x) / distance, (y - r_y) / distance
            rows[count, 0], rows[count, 1] = n_x, r_x * n_y - r_y * n_x
            rows[count, 2] = allowed_approach(distance - margin, gain, braking, dt)
            count += 1
    return rows[:count]


@njit(cache=True)
def _range(rows: FloatArray, turn: float) -> tuple[float, float]:
    """Least and greatest speed that all rows allow with a turn [m/s]; none if least > greatest."""
    least, most = -np.inf, np.inf
    for k in range(len(rows)):
        room = rows[k, 2] - rows[k, 1] * turn
        if abs(rows[k, 0]) > 1e-9:
            if rows[k, 0] > 0.0:
                most = min(most, room / rows[k, 0])
            else:
                least = max(least, room / rows[k, 0])
        elif room < 0.0:
            return np.inf, -np.inf
    return least, most
