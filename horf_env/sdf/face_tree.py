"""Nearest face of a mesh for all nodes of a grid: a tree of boxes, compiled.

Neighbours have neighbouring answers: the face nearest to the node before bounds the distance from
the beginning, and most of the tree is never visited.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from horf_env.sdf.geometry import face_rows
from horf_env.sdf.polytope import FAST, triangle_offset
from horf_env.types import FloatArray, IntArray

_LEAF = 16  # faces in a box of the lowest level, at most
_DEPTH = 64  # boxes that wait to be visited: no tree is half as high


class FaceTree(NamedTuple):
    """Faces of a mesh, sorted into a complete binary tree of boxes.

    Attributes:
        boxes: Lower and upper corner of each box, m; box i holds boxes 2i + 1 and 2i + 2, and the
            last half of the boxes the faces; shape (2 L - 1, 6).
        rows: Faces as in `BodyGeometry.faces`, those of one box side by side, some repeated to
            make boxes equal; shape (L * m, 12).
        balls: Centre and radius of a ball around each of them, shape (L * m, 4), m.
        order: Index of each of them in the mesh, shape (L * m,).
    """

    boxes: FloatArray
    rows: FloatArray
    balls: FloatArray
    order: IntArray


def face_tree(triangles: FloatArray) -> FaceTree:
    """Halve the faces at the median of the longest axis until few are left.

    Args:
        triangles: Corners of the faces, shape (F, 3, 3), m.
    """
    height = max(int(np.ceil(np.log2(len(triangles) / _LEAF))), 0)
    size = -(-len(triangles) // 2**height)
    order = np.resize(np.arange(len(triangles)), (1, size * 2**height))
    centres = triangles.mean(axis=1)
    for _ in range(height):
        places = centres[order]
        axis = np.ptp(places, axis=1).argmax(axis=1)
        along = np.take_along_axis(places, axis[:, None, None], axis=2)[..., 0]
        order = np.take_along_axis(order, along.argsort(axis=1), axis=1)
        order = order.reshape(2 * len(order), -1)
    leaves = triangles[order].reshape(len(order), -1, 3)
    levels = [np.hstack([leaves.min(axis=1), leaves.max(axis=1)])]
    while len(levels[0]) > 1:
        pairs = levels[0].reshape(-1, 2, 6)
        levels.insert(0, np.hstack([pairs[..., :3].min(axis=1), pairs[..., 3:].max(axis=1)]))
    order = order.ravel()
    faces = triangles[order]
    return FaceTree(np.concatenate(levels), face_rows(faces), _balls(faces), order)


def _balls(triangles: FloatArray) -> FloatArray:
    centres = 0.5 * (triangles.min(axis=1) + triangles.max(axis=1))
    radii = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
    return np.column_stack([centres, radii])


@njit(cache=True, fastmath=FAST, error_model="numpy")
def nearest_on_grid(
    tree: FaceTree, frame: FloatArray, offsets: FloatArray, nearest: IntArray
) -> None:
    """Way from the nearest surface point to each node of a grid, and the face that holds it.

    Args:
        tree: The mesh.
        frame: Of the grid; see `Fields`.
        offsets: Written, shape (n^3, 3), m.
        nearest: Written, shape (n^3,).
    """
    waiting, bounds = np.empty(_DEPTH, dtype=np.int64), np.empty(_DEPTH)
    n, row, first = int(frame[9]) + 1, 0, 0
    for i in range(n):
        x = frame[0] + i * frame[6]
        for j in range(n):
            y = frame[1] + j * frame[7]
            guess = first
            for k in range(n):
                z = frame[2] + k * frame[8]
                guess = _nearest_face(
                    tree.boxes, tree.rows, tree.balls, waiting, bounds, guess, x, y, z
                )
                _, dx, dy, dz, _ = triangle_offset(tree.rows, guess, x, y, z)
                offsets[row, 0], offsets[row, 1], offsets[row, 2] = dx, dy, dz
                nearest[row] = tree.order[guess]
                row += 1
                if k == 0:
                    first = guess


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _nearest_face(
    boxes: FloatArray,
    rows: FloatArray,
    balls: FloatArray,
    waiting: IntArray,
    bounds: FloatArray,
    guess: int,
    x: float,
    y: float,
    z: float,
) -> int:
    """Row of the face nearest to a point, found depth first, the nearer box before the other."""
    least, best = triangle_offset(rows, guess, x, y, z)[0], guess
    first_leaf = len(boxes) // 2
    size = len(rows) // (first_leaf + 1)
    waiting[0], bounds[0], count = 0, 0.0, 1
    while count:
        count -= 1
        box = waiting[count]
        if bounds[count] >= least:
            continue
        if box >= first_leaf:
            start = (box - first_leaf) * size
            least, best = _nearest_of(rows, balls, start, start + size, least, best, x, y, z)
            continue
        near, far = 2 * box + 1, 2 * box + 2
        a, b = _box_square(boxes, near, x, y, z), _box_square(boxes, far, x, y, z)
        if b < a:
            near, far, a, b = far, near, b, a
        if b < least:
            waiting[count], bounds[count] = far, b
            count += 1
        if a < least:
            waiting[count], bounds[count] = near, a
            count += 1
    return best


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _nearest_of(
    rows: FloatArray,
    balls: FloatArray,
    start: int,
    stop: int,
    least: float,
    best: int,
    x: float,
    y: float,
    z: float,
) -> tuple[float, int]:
    """Least squared distance of a point from faces [m^2], if below that given, and the face."""
    distance = np.sqrt(least)
    for f in range(start, stop):
        dx, dy, dz = balls[f, 0] - x, balls[f, 1] - y, balls[f, 2] - z
        if dx * dx + dy * dy + dz * dz >= (distance + balls[f, 3]) ** 2:
            continue
        squared = triangle_offset(rows, f, x, y, z)[0]
        if squared < least:
            least, best, distance = squared, f, np.sqrt(squared)
    return least, best


@njit(cache=True, fastmath=FAST)
def _box_square(boxes: FloatArray, box: int, x: float, y: float, z: float) -> float:
    """Squared distance of a point from a box [m^2]."""
    dx = max(boxes[box, 0] - x, x - boxes[box, 3], 0.0)
    dy = max(boxes[box, 1] - y, y - boxes[box, 4], 0.0)
    dz = max(boxes[box, 2] - z, z - boxes[box, 5], 0.0)
    return dx * dx + dy * dy + dz * dz
