"""Points sampled on the robot's surface: what point-based avoidance knows of a robot's shape."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from horf_env.robot import (
    ARM_READY,
    MobileManipulator,
    RobotState,
    collision_parts,
)
from horf_env.sdf.gradient import distance_gradient
from horf_env.sdf.surface import surface_points
from horf_env.sdf.witnesses import Witnesses
from horf_env.types import FloatArray, IntArray

_POOL_SPACING = 0.03  # m between the surface points to choose from


class BodySamples:
    """A fixed number of well spread surface points, and their distances to a cloud (HFBS)."""

    def __init__(self, samples: tuple[FloatArray, ...]) -> None:
        """Keep the samples.

        Args:
            samples: Points of each body in its frame, nine arrays (n_k, 3), m.
        """
        self.count = max(len(points) for points in samples)
        self._local = np.zeros((len(samples), self.count, 3))
        self._used = np.zeros(self._local.shape[:2], dtype=bool)
        for k, points in enumerate(samples):
            self._local[k, : len(points)] = points
            self._used[k, : len(points)] = True

    @classmethod
    def load(cls, robot: MobileManipulator, count: int = 40) -> BodySamples:
        """Farthest-point sample of the whole surface with the arm in its ready posture.

        Args:
            robot: Kinematics that place the bodies.
            count: Points on the whole robot; 40 in the paper, which does not say where.
        """
        pools = [surface_points(parts, _POOL_SPACING) for parts in collision_parts()]
        poses = robot.link_poses(np.concatenate([np.zeros(3), ARM_READY]))
        world = [pool @ T[:3, :3].T + T[:3, 3] for pool, T in zip(pools, poses, strict=True)]
        body = np.repeat(np.arange(len(pools)), [len(pool) for pool in pools])
        seeds = np.flatnonzero(np.diff(body, prepend=-1))  # one point on each body at least
        chosen = _farthest_points(np.concatenate(world), seeds, count)
        local = np.concatenate(pools)
        return cls(tuple(local[chosen[body[chosen] == k]] for k in range(len(pools))))

    def witnesses(self, points: FloatArray, state: RobotState) -> Witnesses:
        """Nearest cloud point of each sample.

        Args:
            points: Cloud in the world, shape (N, 3), m; N may be 0.
            state: State of the robot.

        Returns:
            One entry a sample, each body's nearest first. The distance is the sample's, which is
            never less than the body's; places without a sample are at infinity.
        """
        shape = self._used.shape
        distance, index = np.full(shape, np.inf), np.full(shape, -1, dtype=np.int64)
        point, normal = np.zeros((*shape, 3)), np.zeros((*shape, 3))
        if len(points):
            R, t = state.link_poses[:, :3, :3], state.link_poses[:, None, :3, 3]
            world = (self._local @ R.transpose(0, 2, 1) + t)[self._used]
            distance[self._used], index[self._used] = cKDTree(points).query(world)
            point[self._used] = points[index[self._used]]
            away = point[self._used] - world
            length = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), np.finfo(float).tiny)
            normal[self._used] = away / length
        order = np.argsort(distance, axis=1, kind="stable")
        distance, index = (np.take_along_axis(a, order, axis=1) for a in (distance, index))
        point, normal = (np.take_along_axis(a, order[..., None], axis=1) for a in (point, normal))
        gradient = distance_gradient(state, np.arange(shape[0]), point, normal)
        return Witnesses(distance, normal, gradient, point, index)


def _farthest_points(points: FloatArray, seeds: IntArray, count: int) -> IntArray:
    """Greedy choice: the next point is the one farthest from those chosen; indices (count,)."""
    chosen = list(seeds)
    nearest = cKDTree(points[seeds]).query(points)[0]
    while len(chosen) < count:
        chosen.append(np.argmax(nearest))
        nearest = np.minimum(nearest, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)
