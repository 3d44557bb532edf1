"""Nodes of a grid in six bytes each instead of sixteen, for the cache file.

The distance becomes a multiple of a step, rounded down so that it is never too large. The gradient
is a unit vector: the point where it meets the octahedron |x| + |y| + |z| = 1, unfolded into a
square. Both keep fifteen bits and more; packing what was unpacked changes nothing.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import FloatArray

_MOST = 2**15 - 1  # in 16 bits with a sign


def pack(nodes: FloatArray) -> tuple[np.ndarray, float]:
    """Distance and both numbers of the gradient as int16, shape (N, 3), and the step [m].

    Args:
        nodes: Distance [m] and its gradient, shape (N, 4).
    """
    distance, gradient = nodes[:, 0], nodes[:, 1:].astype(float)
    # A power of two: its multiples are exact in float32.
    step = float(2.0 ** np.ceil(np.log2(np.abs(distance).max() / _MOST)))
    gradient /= np.abs(gradient).sum(axis=1, keepdims=True)
    square = np.where(gradient[:, 2:] < 0.0, _folded(gradient[:, :2]), gradient[:, :2])
    numbers = [np.floor(distance / step), *np.rint(_MOST * square.T)]
    return np.column_stack(numbers).astype(np.int16), step


@njit(cache=True)
def unpack(packed: np.ndarray, step: float, nodes: np.ndarray) -> None:
    """Write distances and gradients.

    Args:
        packed: See `pack`.
        step: See `pack`.
        nodes: Written, float32, shape (N, 4).
    """
    for row in range(len(packed)):
        x, y = packed[row, 1] / _MOST, packed[row, 2] / _MOST
        z = 1.0 - abs(x) - abs(y)
        if z < 0.0:
            x, y = np.copysign(1.0 - abs(y), x), np.copysign(1.0 - abs(x), y)
        scale = 1.0 / np.sqrt(x * x + y * y + z * z)
        nodes[row, 0] = packed[row, 0] * step
        nodes[row, 1], nodes[row, 2], nodes[row, 3] = x * scale, y * scale, z * scale


def _folded(square: np.ndarray) -> np.ndarray:
    """The lower half of the octahedron in the corners of the square, and back."""
    return np.copysign(1.0 - np.abs(square[:, ::-1]), square)
