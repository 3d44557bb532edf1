"""What obstacles hide of which a side or two were seen.

From the far corner of a box that shows two sides one line leads to one of them, and another one, at
a right angle, to the other. A box that shows one side is taken to be half as deep as that is wide.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.types import BoolArray

# Neighbours of a cell, each an eighth of a turn further: the next but one is at a right angle.
_NEIGHBOURS = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)])


@njit(cache=True)
def enclosed(sides: BoolArray, unseen: BoolArray, reach: int) -> BoolArray:
    """Unseen cells from which two lines at a right angle lead over unseen cells to sides.

    Args:
        sides: Cells of sides that were seen, shape (n, m).
        unseen: Cells that nobody has looked at, shape (n, m).
        reach: How far a side may be, in cells.

    Returns:
        Shape (n, m).
    """
    found, open_to = np.zeros_like(sides), np.zeros(len(_NEIGHBOURS), dtype=np.bool_)
    for i in range(sides.shape[0]):
        for j in range(sides.shape[1]):
            if not unseen[i, j]:
                continue
            for k in range(len(open_to)):
                open_to[k] = _leads_to_side(sides, unseen, i, j, k, reach)
            for k in range(len(open_to)):
                found[i, j] |= open_to[k] and open_to[(k + 2) % len(open_to)]
    return found


@njit(cache=True)
def _leads_to_side(
    sides: BoolArray, unseen: BoolArray, i: int, j: int, direction: int, reach: int
) -> bool:
    """Whether a line in one of the directions meets a side before anything that was seen."""
    di, dj = _NEIGHBOURS[direction]
    for _ in range(int(reach / np.hypot(di, dj))):
        i, j = i + di, j + dj
        if not (0 <= i < sides.shape[0] and 0 <= j < sides.shape[1]):
            return False
        if sides[i, j]:
            return True
        if not unseen[i, j]:
            return False
    return False
