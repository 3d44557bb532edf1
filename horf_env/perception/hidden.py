"""What obstacles may hide: unseen space above and behind surfaces that were seen.

An obstacle is thicker than its visible surface and stands on what is below it. Space that no ray
has passed, right above a seen surface or a little behind it, is therefore taken as occupied
(not in the paper). Other unseen space is not: taking all of it froze the robot. What is seen
from below, a table top, hangs: it is taken for a plate with nothing on it but what was seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from horf_env.perception.voxel_grid import BIT, COVERED, VoxelGrid, near_points, wrapped
from horf_env.types import FloatArray

_CLEAR = 4
"""Layers that were seen free below a surface that hangs."""


class HiddenSpace(NamedTuple):
    """Work space: bits of layers for each column of a square about the base, shape (K + 2, K + 2).

    Attributes:
        unseen: Layers that nobody has looked at; none on the border.
        filled: Layers that are occupied or taken as such.
        grown: The same after one more step.
        around: Layers that surround occupied ones, grown in all directions.
        wider: The same after one more step.
        left: All bits in the columns whose second number is in the lower half, no bit elsewhere.
    """

    unseen: np.ndarray
    filled: np.ndarray
    grown: np.ndarray
    around: np.ndarray
    wider: np.ndarray
    left: np.ndarray


def hidden_space(side: int) -> HiddenSpace:
    """Work space for a square of `side` columns."""
    shape = (side + 2, side + 2)
    words = [np.zeros(shape, dtype=np.uint64) for _ in HiddenSpace._fields]
    words[-1][:, : side // 2 + 1] = ~np.uint64(0)
    return HiddenSpace(*words)


@njit(cache=True)
def obstacle_points(
    grid: VoxelGrid,
    space: HiddenSpace,
    middle: tuple[float, float],
    radii: tuple[float, float],
    body_layers: np.uint64,
    above: bool,
    plate: int,
    behind: int,
    out: FloatArray,
) -> FloatArray:
    """Points that were seen, and the middles of the outermost hidden voxels.

    Args:
        grid: The grid.
        space: Work space; its shape says how large the area is in which hidden voxels count.
        middle: Middle of the area [m].
        radii: Within the first all points that were seen count, every second one within the
            second [m].
        body_layers: Bits of the layers that are free where the base has stood.
        above: Whether all that is unseen right above an occupied voxel counts.
        plate: How far, in voxels, it counts above one that hangs.
        behind: How far, in voxels, unseen space behind an occupied voxel counts.
        out: Work space for the points, shape (M, 3), m.

    Returns:
        Shape (N, 3), m.
    """
    found = near_points(grid, middle[0], middle[1], radii[0], radii[1], out)
    found = _append_hidden(grid, space, middle, body_layers, above, plate, behind, out, found)
    return out[:found].copy()


@njit(cache=True)
def _append_hidden(
    grid: VoxelGrid,
    space: HiddenSpace,
    middle: tuple[float, float],
    body_layers: np.uint64,
    above: bool,
    plate: int,
    behind: int,
    out: FloatArray,
    found: int,
) -> int:
    """Append the hidden voxels to the points that `out` holds; return how many it holds then."""
    side, size = len(space.unseen) - 2, grid.size
    first_x = int(np.floor(middle[0] / size)) - side // 2
    first_y = int(np.floor(middle[1] / size)) - side // 2
    _load(grid, space, first_x, first_y, body_layers, above, plate)
    unseen, filled, grown = space.unseen, space.filled, space.grown
    around, wider = space.around, space.wider
    around[:] = filled
    for _ in range(behind):
        _grow(unseen, filled, grown, space.left)
        _spread(unseen, around, wider)
        filled, grown, around, wider = grown, filled, wider, around
    _remember(grid, around, filled, first_x, first_y)
    for i in range(1, side + 1):
        for j in range(1, side + 1):
            hidden = filled[i, j] & unseen[i, j]
            if hidden == 0:
                continue
            inside = filled[i, j] << BIT & (filled[i, j] >> BIT)
            inside &= filled[i - 1, j] & filled[i + 1, j] & filled[i, j - 1] & filled[i, j + 1]
            shell = hidden & ~inside
            z = 0
            while shell:
                if shell & BIT and found < len(out):
                    out[found, 0] = (first_x + i - 0.5) * size
                    out[found, 1] = (first_y + j - 0.5) * size
                    out[found, 2] = (z + 0.5) * size
                    found += 1
                shell, z = shell >> BIT, z + 1
    return found


@njit(cache=True)
def _load(
    grid: VoxelGrid,
    space: HiddenSpace,
    first_x: int,
    first_y: int,
    body_layers: np.uint64,
    above: bool,
    plate: int,
) -> None:
    """Copy the area into the work space and fill upwards."""
    n, side = len(grid.seen), len(space.unseen) - 2
    grid_seen, grid_occupied = grid.seen, grid.occupied
    space_unseen, filled = space.unseen, space.filled
    all_layers = ~np.uint64(0) >> np.uint64(64 - grid.place.shape[2])
    for i in range(side):
        x, unseen, fill = wrapped(first_x + i, n), space_unseen[i + 1, 1:], filled[i + 1, 1:]
        for j in range(side):
            y = wrapped(first_y + j, n)
            seen, occupied = grid_seen[x, y], grid_occupied[x, y]
            if seen & COVERED:
                seen |= body_layers
            unseen[j] = ~(seen | occupied) & all_layers
            fill[j] = occupied
        if above:
            for j in range(side):
                if fill[j]:  # most columns are empty
                    fill[j] = _filled_upwards(fill[j], unseen[j], plate)


@njit(cache=True)
def _remember(
    grid: VoxelGrid, around: np.ndarray, filled: np.ndarray, first_x: int, first_y: int
) -> None:
    """Join what is hidden from here with what was hidden from where the robot was before.

    Only around what is still occupied: an obstacle that disappears hides nothing any more.
    """
    n, side, hidden = len(grid.seen), len(around) - 2, grid.hidden
    for i in range(side):
        x, fill, near = wrapped(first_x + i, n), filled[i + 1, 1:], around[i + 1, 1:]
        for j in range(side):
            y = wrapped(first_y + j, n)
            fill[j] |= hidden[x, y] & near[j]
            hidden[x, y] = fill[j]


@njit(cache=True)
def _filled_upwards(occupied: np.uint64, unseen: np.uint64, plate: int) -> np.uint64:
    """Occupied bits and the runs of unseen bits right above them, `plate` bits of those that hang.

    A one added to the lowest bit of a run carries through all of it and clears it.
    """
    hanging = _hanging(occupied, ~(occupied | unseen))
    carried = unseen + (unseen & (occupied & ~hanging) << BIT)
    for _ in range(plate):
        hanging |= hanging << BIT & unseen
    return occupied | hanging | (unseen & ~carried)


@njit(cache=True)
def _hanging(occupied: np.uint64, free: np.uint64) -> np.uint64:
    """Runs of occupied bits above some that were seen free."""
    clear = free << BIT
    for _ in range(_CLEAR - 1):
        clear &= clear << BIT
    return occupied & ~(occupied + (occupied & clear))


@njit(cache=True)
def _grow(unseen: np.ndarray, filled: np.ndarray, grown: np.ndarray, left: np.ndarray) -> None:
    """Grow by one voxel into the unseen, away from the middle.

    The robot, in the middle, saw the near side of things. Rows are taken as one, for vector
    instructions: nothing grows on the border, where nothing is unseen.
    """
    width = len(unseen)
    middle = width // 2 * width
    may, old, new, side = unseen.ravel(), filled.ravel(), grown.ravel(), left.ravel()
    _grow_from(old[2 * width :], may, old, new, side, width, middle)
    _grow_from(old[middle - width :], may, old, new, side, middle, len(may) - width)


@njit(cache=True)
def _grow_from(
    nearer: np.ndarray,
    unseen: np.ndarray,
    filled: np.ndarray,
    grown: np.ndarray,
    left: np.ndarray,
    start: int,
    stop: int,
) -> None:
    """Grow the columns from `start` to `stop`; `nearer` begins with the row nearer to the middle.

    Loops start at zero: numba looks up any other index as one that may be negative.
    """
    own, may, new, side = filled[start:], unseen[start:], grown[start:], left[start:]
    before, after = filled[start - 1 :], filled[start + 1 :]
    for k in range(stop - start):
        near = nearer[k] | (after[k] & side[k]) | (before[k] & ~side[k])
        new[k] = own[k] | (may[k] & near)


@njit(cache=True)
def _spread(unseen: np.ndarray, around: np.ndarray, wider: np.ndarray) -> None:
    """Grow by one voxel into the unseen, in all six directions."""
    width, flat = len(unseen), around.ravel()
    may, new, old = unseen.ravel()[width:], wider.ravel()[width:], flat[width:]
    left, right, before, after = flat, flat[2 * width :], flat[width - 1 :], flat[width + 1 :]
    for k in range(len(flat) - 2 * width):
        own = old[k]
        near = left[k] | right[k] | before[k] | after[k]
        new[k] = own | (may[k] & (near | own << BIT | own >> BIT))
