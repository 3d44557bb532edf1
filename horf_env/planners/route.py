"""Shortest ways of the base to where it can reach the goal, on a grid of the true scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from horf_env.perception.sweeping import COMFORT, NARROW_COST
from horf_env.robot.footprint import CARRIED_HEIGHT, GUARDED_HEIGHT
from horf_env.robot.reachability import standing_cost
from horf_env.scenes.distance import outline_distance
from horf_env.scenes.scene import Box, Cylinder, Scene
from horf_env.types import FloatArray

_CELL = 0.1  # m
_BORDER = 2.0  # m of floor around everything that counts
# Least distances of the base's centre to what the base and to what the arm could hit [m]. The
# narrower ones are for scenes without a way that keeps the wider.
_CLEARANCES = ((0.40, 0.30), (0.38, 0.15), (0.36, 0.0))
_STAND_CLEARANCE = 0.38  # m
_AROUND, _DISCOURAGED_COST = 0.35, 3.0  # m, and m of way for each m or to stand there
_NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))


class Route:
    """Ways to the goal from everywhere in a scene."""

    def __init__(self, scene: Scene, goal: FloatArray) -> None:
        """Plan.

        Args:
            scene: The scene, known as it is.
            goal: Pose of the goal in the world, shape (4, 4).
        """
        middles = [b.center[:2] for b in scene.boxes]
        marks = np.array([goal[:2, 3], scene.start.base[:2], *middles])
        self._lower = marks.min(axis=0) - _BORDER
        self._shape = tuple(np.ceil((np.ptp(marks, axis=0) + 2 * _BORDER) / _CELL).astype(int))
        ij = np.stack(np.meshgrid(*map(np.arange, self._shape), indexing="ij"), axis=-1)
        self._points = self._lower + _CELL * ij.reshape(-1, 2)
        self._base = _gaps(scene, self._points, 0.0, GUARDED_HEIGHT)
        self._arm = _gaps(scene, self._points, GUARDED_HEIGHT, CARRIED_HEIGHT)
        clear = self._base > _STAND_CLEARANCE
        self._stands = np.where(clear, standing_cost(goal, self._points), np.inf)
        self._discouraged = np.zeros(len(self._points))
        for base, arm in _CLEARANCES:
            self._free = (self._base > base) & (self._arm > arm)
            self._length, self._next = self._search()
            if np.isfinite(self._length[self._cell(scene.start.base[:2])]):
                break

    def clearance(self, position: FloatArray) -> float:
        """Least distance of a base centre to what base or arm could hit, seen from above [m]."""
        cell = self._cell(position)
        return float(min(self._base[cell], self._arm[cell]))

    def cost(self, position: FloatArray) -> float:
        """Of the way to the goal: m, more where it is narrow; inf off the way."""
        return float(self._length[self._cell(position)])

    def discourage(self, position: FloatArray) -> None:
        """Prefer ways and places to stand that are not near a place (2,) [m]."""
        near = np.linalg.norm(self._points - position, axis=1) < _AROUND
        self._discouraged += np.where(near, _DISCOURAGED_COST, 0.0)
        self._length, self._next = self._search()

    def ahead(self, position: FloatArray, distance: float) -> tuple[FloatArray, float]:
        """Point on the way.

        Args:
            position: Centre of the base, shape (2,), m.
            distance: How far along the way [m].

        Returns:
            The point, shape (2,), m, and the length of way up to it: less than `distance` where
            the way ends. Off the way, that of the nearest place from which there is one.
        """
        cell, length = self._cell(position), 0.0
        if not np.isfinite(self._length[cell]):
            away = np.linalg.norm(self._points - position, axis=1)
            cell = int(np.where(np.isfinite(self._length), away, np.inf).argmin())
        while length < distance and self._next[cell] < len(self._points):
            following = int(self._next[cell])
            length += float(np.linalg.norm(self._points[following] - self._points[cell]))
            cell = following
        point: FloatArray = self._points[cell]
        return point, length

    def _search(self) -> tuple[FloatArray, np.ndarray]:
        """Cost of the way from each cell, and the next cell on it (one past the end at its end)."""
        n = len(self._points)
        stand = self._stands + self._discouraged
        ends = np.flatnonzero(np.isfinite(stand))
        a, b = self._edges(self._free | np.isfinite(stand))
        gap = np.minimum(self._base, self._arm + 0.05)
        step = np.linalg.norm(self._points[a] - self._points[b], axis=1)
        cost = step * (1 + NARROW_COST * np.clip(1 - 0.5 * (gap[a] + gap[b]) / COMFORT, 0, None))
        cost += step * 0.5 * (self._discouraged[a] + self._discouraged[b])
        # A last node behind all places to stand makes it one search. Zero weights are no edges.
        rows, columns = np.append(a, ends), np.append(b, np.full(len(ends), n))
        weights = np.append(cost, stand[ends] + 1e-6)
        graph = coo_matrix((weights, (rows, columns)), shape=(n + 1, n + 1)).tocsr()
        length, following = dijkstra(graph, directed=False, indices=n, return_predecessors=True)
        following = np.where(following[:n] < 0, n, following[:n])
        return length[:n], following

    def _edges(self, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pairs of free neighbours, eight for each inner cell, each pair once."""
        number = np.arange(len(self._points)).reshape(self._shape)
        pairs = []
        for di, dj in _NEIGHBOURS:
            to = number[di:, max(dj, 0) : number.shape[1] + min(dj, 0)]
            rows = slice(None, number.shape[0] - di)
            columns = slice(max(-dj, 0), number.shape[1] - max(dj, 0))
            pairs.append(np.stack([number[rows, columns].ravel(), to.ravel()]))
        a, b = np.concatenate(pairs, axis=1)
        both = free[a] & free[b]
        return a[both], b[both]

    def _cell(self, position: FloatArray | tuple[float, ...]) -> int:
        ij = np.round((np.asarray(position)[:2] - self._lower) / _CELL).astype(int)
        i, j = np.clip(ij, 0, np.array(self._shape) - 1)
        return int(i * self._shape[1] + j)


def _gaps(scene: Scene, points: FloatArray, bottom: float, top: float) -> FloatArray:
    """Distance of points (N, 2) to the outlines of what stands between two heights [m]."""
    part = replace(
        scene,
        boxes=tuple(b for b in scene.boxes if _overlaps(b, b.half_extents[2], bottom, top)),
        cylinders=tuple(c for c in scene.cylinders if _overlaps(c, c.half_height, bottom, top)),
        spheres=tuple(
            s
            for s in scene.spheres
            if bottom < s.center[2] + s.radius and s.center[2] - s.radius < top
        ),
    )
    return outline_distance(part, points)


def _overlaps(body: Box | Cylinder, half_height: float, bottom: float, top: float) -> bool:
    return bottom < body.center[2] + half_height and body.center[2] - half_height < top
