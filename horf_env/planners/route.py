"""Shortest ways of the base to where it can reach the goal, on a grid of the true scene."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.transform import Rotation

from horf_env.robot.footprint import BASE_HEIGHT
from horf_env.scenes.distance import outline_distance
from horf_env.scenes.scene import Box, Cylinder, Scene
from horf_env.types import FloatArray

_CELL = 0.1  # m
_BORDER = 2.0  # m of floor around everything that counts
_ARM_HEIGHT = 1.15  # m; what hangs higher is above the arm in its ready pose
# Least distances of the base's centre to what the base and to what the arm could hit [m]. The
# narrower ones are for scenes without a way that keeps the wider.
_CLEARANCES = ((0.40, 0.30), (0.38, 0.15), (0.36, 0.0))
# Below this distance [m] a way costs up to seven times as much, so that it keeps to the middle.
_COMFORT, _NARROW_COST = 0.75, 6.0
# Where the base may stand for the last reach: distance from the goal [m], and how far beside the
# line of approach if that is level.
_STAND_UPRIGHT, _STAND_LEVEL, _BESIDE = (0.55, 0.75, 0.95), (0.6, 0.9, 1.3), 0.5
_STAND_CLEARANCE = 0.38  # m
_STAND_COST = 2.0  # m of way for each m off the best place
_NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))


class Route:
    """Ways to the goal from everywhere in a scene."""

    def __init__(self, scene: Scene) -> None:
        """Plan.

        Args:
            scene: The scene, known as it is.
        """
        self._goal = np.array(scene.goal.position[:2])
        self._approach = Rotation.from_quat(scene.goal.quaternion_xyzw).as_matrix()[:2, 2]
        middles = [b.center[:2] for b in scene.boxes]
        marks = np.array([self._goal, scene.start.base[:2], *middles])
        self._lower = marks.min(axis=0) - _BORDER
        self._shape = tuple(np.ceil((np.ptp(marks, axis=0) + 2 * _BORDER) / _CELL).astype(int))
        ij = np.stack(np.meshgrid(*map(np.arange, self._shape), indexing="ij"), axis=-1)
        self._points = self._lower + _CELL * ij.reshape(-1, 2)
        self._base = _gaps(scene, self._points, 0.0, BASE_HEIGHT + 0.05)
        self._arm = _gaps(scene, self._points, BASE_HEIGHT + 0.05, _ARM_HEIGHT)
        for base, arm in _CLEARANCES:
            free = (self._base > base) & (self._arm > arm)
            self._length, self._next = self._search(free)
            if np.isfinite(self._length[self._cell(scene.start.base[:2])]):
                break

    def clearance(self, position: FloatArray) -> float:
        """Least distance of a base centre to what base or arm could hit, seen from above [m]."""
        cell = self._cell(position)
        return float(min(self._base[cell], self._arm[cell]))

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

    def _search(self, free: np.ndarray) -> tuple[FloatArray, np.ndarray]:
        """Cost of the way from each cell, and the next cell on it (one past the end at its end)."""
        n = len(self._points)
        stand = self._standing_cost()
        ends = np.flatnonzero(np.isfinite(stand))
        a, b = self._edges(free | np.isfinite(stand))
        gap = np.minimum(self._base, self._arm + 0.05)
        step = np.linalg.norm(self._points[a] - self._points[b], axis=1)
        cost = step * (1 + _NARROW_COST * np.clip(1 - 0.5 * (gap[a] + gap[b]) / _COMFORT, 0, None))
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

    def _standing_cost(self) -> FloatArray:
        """How good each cell is to stand at for the last reach; inf where it is not."""
        offset = self._goal - self._points
        level = np.linalg.norm(self._approach)
        if level > 0.5:  # from behind the gripper
            along = offset @ (self._approach / level)
            beside = np.abs(offset @ np.array([-self._approach[1], self._approach[0]]) / level)
            near, best, far = _STAND_LEVEL
        else:
            along, beside = np.linalg.norm(offset, axis=1), np.zeros(len(offset))
            near, best, far = _STAND_UPRIGHT
        good = (along > near) & (along < far) & (beside < _BESIDE) & (self._base > _STAND_CLEARANCE)
        cost = _STAND_COST * (np.abs(along - best) + beside)
        return np.where(good, cost, np.inf)

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
