"""Answers of the distance queries."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from horf_env.types import FloatArray, IntArray

DISTANCE, NORMAL, PLACE, GRADIENT = 0, 1, 4, 7
"""Where distance, normal, place and gradient of a point begin in the kernels' table of numbers."""


@dataclass(frozen=True)
class LinkDistances:
    """Nearest cloud point of each body.

    Attributes:
        distance: Signed distance of each body [m], inf without points; shape (B,).
        point_index: Index of the nearest point in the cloud, -1 without points; shape (B,).
        gradient: d distance / d velocity, zeros without points; shape (B, n).
    """

    distance: FloatArray
    point_index: IntArray
    gradient: FloatArray


@dataclass(frozen=True)
class Witnesses:
    """Up to K points for each of the B bodies; a body's nearest point comes first.

    Where the distance has no gradient, because several surface points are equally near (in the
    middle of a body) or the point lies on an edge or corner, it is that of one of them: finite,
    normals of unit length. Of equally near cloud points one is taken.

    Attributes:
        distance: Signed distance of each point to its body [m], inf where there is none; (B, K).
        normal: Gradient of the distance with respect to the point, world axes; shape (B, K, 3).
        gradient: d distance / d velocity, zeros where there is no point; shape (B, K, n).
        point: World position of each point [m], zeros where there is none; shape (B, K, 3).
        index: Index of each point in the cloud, -1 where there is none; shape (B, K).
    """

    distance: FloatArray
    normal: FloatArray
    gradient: FloatArray
    point: FloatArray
    index: IntArray

    @classmethod
    def from_table(cls, numbers: FloatArray, index: IntArray) -> Witnesses:
        """Views of the kernels' answers (B, K, 7 + n) and (B, K)."""
        return cls(
            distance=numbers[..., DISTANCE],
            normal=numbers[..., NORMAL:PLACE],
            gradient=numbers[..., GRADIENT:],
            point=numbers[..., PLACE:GRADIENT],
            index=index,
        )


def empty_table(n_bodies: int, count: int, n_velocities: int) -> tuple[FloatArray, IntArray]:
    """Numbers (B, K, 7 + n) and indices (B, K) of no points at all."""
    numbers, indices = _blank_table(n_bodies, count, n_velocities)
    return numbers.copy(), indices.copy()


@cache  # to copy an empty table takes a third of the time to fill one
def _blank_table(n_bodies: int, count: int, n_velocities: int) -> tuple[FloatArray, IntArray]:
    numbers = np.zeros((n_bodies, count, GRADIENT + n_velocities))
    numbers[:, :, DISTANCE] = np.inf
    return numbers, np.full((n_bodies, count), -1)
