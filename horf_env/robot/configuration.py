"""Motion of the configuration (x, y, theta, q1..q7) under a velocity (v, omega, qd1..qd7)."""

from __future__ import annotations

import math

import numpy as np

from horf_env.types import FloatArray

# Below this turn [rad] the arc is drawn as its chord's Taylor series; the error is under 1e-13 m.
_STRAIGHT_TURN = 1e-4

# The map at heading 0, but without the base's forward speed: turn and joints move themselves.
_HEADLESS_MAP = np.eye(10, 9, k=-1)
_HEADLESS_MAP[1, 0] = 0.0


def integrate(configuration: FloatArray, velocity: FloatArray, dt: float) -> FloatArray:
    """Configuration after a time at constant velocity.

    The base follows the exact circular arc of a unicycle, not an Euler step, so that the result of
    two half steps equals that of a whole one.

    Args:
        configuration: Shape (10,), m and rad.
        velocity: Shape (9,), m/s and rad/s.
        dt: Duration [s].

    Returns:
        Configuration, shape (10,); theta is not wrapped.
    """
    x, y, theta = configuration[:3]
    turn = velocity[1] * dt
    half = 0.5 * turn
    shrink = 1.0 - half**2 / 6.0 if abs(turn) < _STRAIGHT_TURN else np.sin(half) / half
    chord = velocity[0] * dt * shrink
    result = np.empty(10)
    result[0] = x + chord * np.cos(theta + half)
    result[1] = y + chord * np.sin(theta + half)
    result[2] = theta + turn
    result[3:] = configuration[3:] + velocity[2:] * dt
    return result


def velocity_map(theta: float) -> FloatArray:
    """Rates of the configuration for each velocity: configuration_dot = velocity_map @ velocity.

    Returns:
        Shape (10, 9). The first column is the rolling constraint of a differential drive.
    """
    B = _HEADLESS_MAP.copy()
    B[0, 0] = math.cos(theta)
    B[1, 0] = math.sin(theta)
    return B
