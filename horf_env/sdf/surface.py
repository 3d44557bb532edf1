"""Points on the surface of a body."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from horf_env.robot import Part
from horf_env.types import FloatArray


def surface_points(parts: Sequence[Part], spacing: float) -> FloatArray:
    """Points on the surface of a body, shape (N, 3), frame of the body.

    Args:
        parts: The body.
        spacing: Neighbours are no farther apart [m].
    """
    pieces = [
        trimesh.remesh.subdivide_to_size(part.vertices, part.faces, max_edge=spacing)[0]
        for part in parts
    ]
    return np.unique(np.round(np.concatenate(pieces), 6), axis=0)
