"""What the compiled kernels read and write.

A call from Python pays for each array that it passes, so the work space and the answers are a few
arrays with several rows, and the shape comes as a plain tuple, which costs 1 us less than a named
one. Inside, functions pass bundles on. What is called once a body or once a point is copied into
its caller (`inline="always"`): a call with bundles counts references to each of their arrays, which
took a tenth of a query.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from horf_env.sdf.fields import Fields
from horf_env.sdf.geometry import BodyGeometry
from horf_env.sdf.scan import CHUNK
from horf_env.types import FloatArray, IntArray


class Shape(NamedTuple):
    """The bodies; see `BodyGeometry` and `Fields`."""

    planes: FloatArray
    faces: FloatArray
    links: np.ndarray
    part_start: IntArray
    body_start: IntArray
    boxes: FloatArray
    part_boxes: FloatArray
    nodes: np.ndarray
    near_faces: np.ndarray
    frames: FloatArray


def shape_of(geometry: BodyGeometry, fields: Fields) -> Shape:
    """Bundle geometry and fields."""
    g = geometry
    return Shape(
        g.planes,
        g.faces,
        g.links,
        g.part_start,
        g.body_start,
        g.boxes,
        g.part_boxes,
        fields.nodes,
        fields.near_faces,
        fields.frames,
    )


class Work(NamedTuple):
    """Scratch memory of a query of N points, in M chunks.

    Attributes:
        cloud: Points relative to the robot, float32, shape (3, >= N).
        squared: Squared distances from the box of the body at hand, float32, shape (M * CHUNK,).
        keys: Order of the witness points of that body, float32, shape (M * CHUNK,).
        squared_minima: Least of each chunk of `squared`, float32, shape (M,).
        key_minima: The same of `keys`.
        listed: Indices of points that may matter, shape (>= N,).
        local: Their coordinates in the frame of the body, shape (3, >= N), m.
        lower: A number for each of them, shape (>= N,).
        heights: Heights above the faces, shape (F,).
    """

    cloud: np.ndarray
    squared: np.ndarray
    keys: np.ndarray
    squared_minima: np.ndarray
    key_minima: np.ndarray
    listed: IntArray
    local: FloatArray
    lower: FloatArray
    heights: FloatArray


class WorkSpace(NamedTuple):
    """Memory behind `Work`, used again by the next query.

    Attributes:
        single: Cloud, squared distances and keys, float32, shape (5, C).
        minima: Least of the chunks of the last two, float32, shape (2, C / CHUNK).
        double: Local coordinates and a number, shape (4, C).
        listed: Shape (C,).
        heights: Shape (F,).
    """

    single: np.ndarray
    minima: np.ndarray
    double: FloatArray
    listed: IntArray
    heights: FloatArray


def work_space(n_points: int, n_faces: int) -> WorkSpace:
    """Memory for clouds of up to `n_points` points, rounded up to whole chunks."""
    n_chunks = -(-n_points // CHUNK)
    size = n_chunks * CHUNK
    return WorkSpace(
        single=np.zeros((5, size), dtype=np.float32),
        minima=np.empty((2, n_chunks), dtype=np.float32),
        double=np.empty((4, size)),
        listed=np.empty(size, dtype=np.int64),
        heights=np.empty(n_faces),
    )


@njit(cache=True)
def work_of(
    n_points: int,
    single: np.ndarray,
    minima: np.ndarray,
    double: FloatArray,
    listed: IntArray,
    heights: FloatArray,
) -> Work:
    """The part of the work space that a cloud of this size needs."""
    n_chunks = (n_points + CHUNK - 1) // CHUNK
    size = n_chunks * CHUNK
    return Work(
        single[:3],
        single[3, :size],
        single[4, :size],
        minima[0, :n_chunks],
        minima[1, :n_chunks],
        listed,
        double[:3],
        double[3],
        heights,
    )
