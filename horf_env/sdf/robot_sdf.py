"""Robot-centric signed distance: from each body of the robot to a cloud of world points."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from horf_env.errors import UnknownNameError
from horf_env.robot import MobileManipulator, RobotState, collision_parts
from horf_env.robot.vectors import cross
from horf_env.sdf.cache import cached_fields
from horf_env.sdf.convex import part_distances
from horf_env.sdf.fields import PADDINGS, Fields
from horf_env.sdf.geometry import BodyGeometry, body_geometry
from horf_env.sdf.kernel import find_witnesses, within
from horf_env.types import FloatArray, IntArray

_LOG = logging.getLogger(__name__)
_GEOMETRIES = ("hull",)
_FIRST_ARM_BODY = 1
_FIRST_FREE_BODY = 3  # the first body of the arm that can touch the base
_BASE_SAMPLING = 0.05  # m between points on the base: 6 mm too far at most at 5 cm distance
_NO_BRAKING = np.inf


@dataclass(frozen=True)
class LinkDistances:
    """Nearest cloud point of each body.

    Attributes:
        distance: Signed distance of each body [m], inf without points; shape (9,).
        point_index: Index of the nearest point in the cloud, -1 without points; shape (9,).
        gradient: d distance / d velocity, zeros without points; shape (9, 9).
    """

    distance: FloatArray
    point_index: IntArray
    gradient: FloatArray


@dataclass(frozen=True)
class Witnesses:
    """Up to K points for each of the nine bodies; a body's nearest point comes first.

    Attributes:
        distance: Signed distance of each point to its body [m], inf where there is none; (9, K).
        normal: Gradient of the distance with respect to the point, world axes; shape (9, K, 3).
        gradient: d distance / d velocity, zeros where there is no point; shape (9, K, 9).
        point: World position of each point [m]; shape (9, K, 3).
        index: Index of each point in the cloud, -1 where there is none; shape (9, K).
    """

    distance: FloatArray
    normal: FloatArray
    gradient: FloatArray
    point: FloatArray
    index: IntArray


class RobotSdf:
    """Distances, witness points and gradients for all bodies at once."""

    def __init__(self, robot: MobileManipulator, geometry: BodyGeometry, fields: Fields) -> None:
        self._robot = robot
        self._geometry = geometry
        g = geometry
        self._shape = (g.planes, g.triangles, g.spheres, g.part_start, g.body_start)
        self._fields = (fields.values, fields.origins, fields.cells)
        self._base_surface = _surface_points(geometry, _BASE_SAMPLING)

    @classmethod
    def load(
        cls,
        robot: MobileManipulator,
        geometry: str = "hull",
        *,
        cache_folder: Path | None = None,
    ) -> RobotSdf:
        """Distance fields of the robot, from the cache or built now.

        Args:
            robot: Kinematics that place the bodies.
            geometry: "hull": the convex hull of each collision mesh, what PyBullet collides with.
            cache_folder: Where the fields are kept; the user's cache folder without it.

        Raises:
            UnknownNameError: If there is no such geometry.
        """
        if geometry not in _GEOMETRIES:
            raise UnknownNameError("SDF geometry", geometry, _GEOMETRIES)
        shape = body_geometry(collision_parts())
        return cls(robot, shape, cached_fields(shape, cache_folder))

    def link_distance(self, k: int, points: FloatArray) -> FloatArray:
        """Exact signed distances to one body.

        Args:
            k: Index of the body, 0 to 8.
            points: Shape (N, 3), frame of the body, m.

        Returns:
            Shape (N,), m, positive outside.
        """
        points = _checked(points)
        g = self._geometry
        parts = range(g.body_start[k], g.body_start[k + 1])
        distances = [
            part_distances(
                points, g.planes, g.triangles, g.spheres, g.part_start[p], g.part_start[p + 1]
            )
            for p in parts
        ]
        return np.asarray(np.min(distances, axis=0))

    def query(self, points: FloatArray, configuration: FloatArray) -> LinkDistances:
        """Nearest point of each body: zeta_k and its gradient in the paper's A_avoi.

        Args:
            points: Cloud in the world, shape (N, 3), m; N may be 0.
            configuration: Shape (10,).

        Raises:
            ValueError: If the points are not finite or of another shape.
        """
        found = self.witnesses(
            points, self._robot.state(configuration), count=1, spacing=0.0, cutoff=np.inf
        )
        return LinkDistances(found.distance[:, 0], found.index[:, 0], found.gradient[:, 0])

    def witnesses(
        self,
        points: FloatArray,
        state: RobotState,
        *,
        count: int,
        spacing: float,
        cutoff: float,
        velocity: FloatArray | None = None,
        braking: float = _NO_BRAKING,
        first_body: int = 0,
    ) -> Witnesses:
        """The nearest and the most critical points of each body.

        A point is the more critical the less is left of its distance after the body has braked
        from its present velocity. The first witness is the nearest point whatever its direction.

        Args:
            points: Cloud in the world, shape (N, 3), m; N may be 0.
            state: State of the robot.
            count: Points a body, K.
            spacing: Least distance between two points of a body [m].
            cutoff: Points that stay farther than this from a body even if it brakes only now [m]
                are left out.
            velocity: Present velocity of the robot, shape (9,); at rest without it.
            braking: Deceleration that a body can count on [m/s^2].
            first_body: Bodies before this one get no witness.

        Raises:
            ValueError: If the points are not finite or of another shape.
        """
        points = _checked(points)
        n_bodies = len(state.link_poses)
        distance = np.full((n_bodies, count), np.inf)
        index = np.full((n_bodies, count), -1, dtype=np.int64)
        normal = np.zeros((n_bodies, count, 3))
        if len(points):
            find_witnesses(
                points,
                state.link_poses,
                _body_twists(state, velocity),
                first_body,
                *self._shape,
                self._geometry.boxes,
                *self._fields,
                PADDINGS[-1],
                cutoff,
                spacing,
                braking,
                distance,
                index,
                normal,
            )
        point = points[index] if len(points) else np.zeros((n_bodies, count, 3))
        gradient = distance_gradient(state, np.arange(n_bodies), point, normal)
        return Witnesses(distance, normal, gradient, point, index)

    def floor_witnesses(self, state: RobotState) -> Witnesses:
        """Height of each body's lowest corner above the floor z = 0, one point a body.

        The floor is known, so it is no part of the cloud. The base stands on it: no point there.
        """
        n_bodies = len(state.link_poses)
        distance, point = np.full((n_bodies, 1), np.inf), np.zeros((n_bodies, 1, 3))
        normal = np.zeros((n_bodies, 1, 3))
        for body in range(_FIRST_ARM_BODY, n_bodies):
            R, t = state.link_poses[body, :3, :3], state.link_poses[body, :3, 3]
            vertices = self._geometry.vertices[body]
            lowest = vertices[np.argmin(vertices @ R[2])]
            point[body, 0] = R @ lowest + t
            distance[body, 0] = point[body, 0, 2]
            normal[body, 0, 2] = -1.0  # raising the floor shortens the distance
        gradient = distance_gradient(state, np.arange(n_bodies), point, normal)
        index = np.full((n_bodies, 1), -1, dtype=np.int64)
        return Witnesses(distance, normal, gradient, point, index)

    def own_base_witnesses(self, state: RobotState, *, cutoff: float) -> Witnesses:
        """Nearest point of the robot's own base for each body of the arm, one point a body.

        The points ride on the base, so only the arm's joints change the distances. Links 1 and 2
        are mounted on the base and cannot reach it.

        Args:
            state: State of the robot.
            cutoff: Points farther than this from a body are left out [m].
        """
        T = state.T_world_base
        points = self._base_surface @ T[:3, :3].T + T[:3, 3]
        found = self.witnesses(
            points, state, count=1, spacing=0.0, cutoff=cutoff, first_body=_FIRST_FREE_BODY
        )
        found.gradient[:, :, :2] = 0.0
        return found

    def on_arm(self, points: FloatArray, state: RobotState, tolerance: float) -> np.ndarray:
        """Which points lie on the robot's own arm.

        Args:
            points: Cloud in the world, shape (N, 3), m.
            state: State of the robot when the points were captured.
            tolerance: How far from the arm a point still counts as its own [m].

        Returns:
            Mask, shape (N,).
        """
        points = _checked(points)
        inside = np.empty(len(points), dtype=np.bool_)
        arm = slice(_FIRST_ARM_BODY, None)
        starts = self._geometry.body_start[arm]
        within(
            points,
            state.link_poses[arm],
            *self._shape[:-1],
            starts,
            self._geometry.boxes[arm],
            tolerance,
            inside,
        )
        return inside


def _surface_points(geometry: BodyGeometry, spacing: float) -> FloatArray:
    """Points on the surface of the base, shape (N, 3), frame of the base."""
    base = geometry.triangles[: geometry.part_start[geometry.body_start[1]]]
    corners = base.reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    points, _ = trimesh.remesh.subdivide_to_size(corners, faces, max_edge=spacing)
    return np.unique(np.round(points, 6), axis=0)


def distance_gradient(
    state: RobotState, bodies: IntArray, points: FloatArray, normals: FloatArray
) -> FloatArray:
    """Chain rule: d distance / d velocity for world-fixed points.

    The distance falls as fast as the body-fixed point under the world point moves along the normal:
    d zeta / d velocity = -normal . J_point.

    Args:
        state: State of the robot.
        bodies: Body of each row of points, shape (B,).
        points: World points, shape (B, K, 3), m.
        normals: Gradients of the distances with respect to the points, shape (B, K, 3).

    Returns:
        Shape (B, K, 9), m per (m or rad).
    """
    J = state.body_jacobians[bodies]
    arm = points - state.link_poses[bodies, None, :3, 3]
    torque = cross(arm, normals)
    return -(normals @ J[:, :3] + torque @ J[:, 3:])


def _body_twists(state: RobotState, velocity: FloatArray | None) -> FloatArray:
    """Velocity of each body (linear at its origin; angular) in its own frame, shape (9, 6)."""
    if velocity is None:
        return np.zeros((len(state.link_poses), 6))
    world = (state.body_jacobians @ velocity).reshape(-1, 2, 3)
    return np.ascontiguousarray((world @ state.link_poses[:, :3, :3]).reshape(-1, 6))


def _checked(points: FloatArray) -> FloatArray:
    points = np.ascontiguousarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points: expected shape (N, 3), got {points.shape}")
    if not np.isfinite(points).all():
        raise ValueError("points: expected finite numbers; drop invalid depth before the query")
    return points
