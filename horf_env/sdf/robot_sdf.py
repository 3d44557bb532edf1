"""Robot-centric signed distance: from each body of the robot to a cloud of world points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from horf_env.errors import CloudError, QueryError, UnknownNameError
from horf_env.robot import Part, RobotState
from horf_env.robot.parts import Elements
from horf_env.robot.placing import placed_points
from horf_env.sdf.arrays import shape_of, work_space
from horf_env.sdf.bodies import measure
from horf_env.sdf.cache import cached_fields
from horf_env.sdf.geometry import body_geometry
from horf_env.sdf.kernel import find_witnesses
from horf_env.sdf.known import find_lowest, mark_within
from horf_env.sdf.robots import Bodies, Robot
from horf_env.sdf.surface import surface_points
from horf_env.sdf.witnesses import DISTANCE, GRADIENT, LinkDistances, Witnesses, empty_table
from horf_env.types import FloatArray, IntArray

_ELEMENTS: dict[str, Elements] = {"hull": "collision", "visual": "visual"}
_FIRST_ARM_BODY = 1
_FIRST_FREE_BODY = 3  # the first body of the arm that can touch the base
_BASE_SAMPLING = 0.05  # m between points on the base: 6 mm too far at most at 5 cm distance
_NO_BRAKING = np.inf
_FIRST_CLOUD = 8192  # points for which there is work space from the beginning
_NOT_FINITE = "points: expected finite numbers; drop invalid depth before the query"


class RobotSdf:
    """Distances, witness points and gradients for all bodies at once."""

    def __init__(
        self, robot: Robot, parts: Sequence[Sequence[Part]], *, cache_folder: Path | None = None
    ) -> None:
        """Take the fields from the cache, or build them.

        Args:
            robot: Kinematics that place the bodies.
            parts: Geometry of each body.
            cache_folder: Where the fields are kept; the user's cache folder without it.
        """
        self._robot = robot
        self._geometry = geometry = body_geometry(parts)
        self._shape = shape_of(geometry, cached_fields(geometry, cache_folder))
        self._arrays = tuple(self._shape)
        self._work = work_space(_FIRST_CLOUD, len(geometry.faces))
        self._base_surface = surface_points(parts[0], _BASE_SAMPLING)
        self._base_only = np.array([0, len(self._base_surface)])
        self._no_spacing = np.zeros(len(parts))

    @classmethod
    def load(
        cls,
        robot: Robot,
        geometry: str = "hull",
        *,
        cache_folder: Path | None = None,
    ) -> RobotSdf:
        """Distance fields of the robot, from the cache or built now.

        Args:
            robot: Kinematics that place the bodies.
            geometry: "hull": the convex hull of each collision mesh, what PyBullet collides with,
                exactly. "visual": the visual meshes as they are, what real obstacles meet,
                interpolated from fields; to build those takes libigl and a few seconds.
            cache_folder: Where the fields are kept; the user's cache folder without it.

        Raises:
            UnknownNameError: If there is no such geometry.
            GeometryError: If a body has no geometry, or a mesh no faces.
            MissingAssetError: If a mesh is missing, or libigl to build the fields of one.
        """
        if geometry not in _ELEMENTS:
            raise UnknownNameError("SDF geometry", geometry, _ELEMENTS)
        return cls(robot, robot.parts(_ELEMENTS[geometry]), cache_folder=cache_folder)

    def link_distance(self, k: int, points: FloatArray) -> FloatArray:
        """Exact signed distances to one body.

        Args:
            k: Index of the body, from 0 on.
            points: Shape (N, 3), frame of the body, m.

        Returns:
            Shape (N,), m, positive outside.

        Raises:
            CloudError: If the points are not finite or of another shape.
            QueryError: If there is no such body.
        """
        points = _checked(points)
        n_bodies = len(self._geometry.boxes)
        if not 0 <= k < n_bodies:
            raise QueryError(f"body {k}: expected 0 to {n_bodies - 1}")
        distances = np.empty(len(points))
        measure(self._shape, self._work.heights, k, np.array(points.T, order="C"), distances)
        return distances

    def query(self, points: FloatArray, configuration: FloatArray) -> LinkDistances:
        """Nearest point of each body: zeta_k and its gradient in the paper's A_avoi.

        Args:
            points: Cloud in the world, shape (N, 3), m; N may be 0.
            configuration: Shape (10,).

        Raises:
            CloudError: If the points are not finite or of another shape.
        """
        state = self._robot.state(configuration)
        numbers, indices = self._table(points, state, 1, self._no_spacing, np.inf)
        return LinkDistances(numbers[:, 0, DISTANCE], indices[:, 0], numbers[:, 0, GRADIENT:])

    def witnesses(
        self,
        points: FloatArray,
        state: Bodies,
        *,
        count: int,
        spacing: float | FloatArray,
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
            spacing: Least distance between two points of a body [m]; one number, or one a body.
            cutoff: Points that stay farther than this from a body even if it brakes only now [m]
                are left out.
            velocity: Present velocity of the robot, shape (9,); at rest without it.
            braking: Deceleration that a body can count on [m/s^2].
            first_body: Bodies before this one get no witness.

        Raises:
            CloudError: If the points are not finite or of another shape.
            QueryError: If count, spacing or velocity fit neither a body nor the robot.
        """
        if not isinstance(spacing, np.ndarray):
            spacing = np.full(len(state.link_poses), spacing, dtype=float)
        return Witnesses.from_table(
            *self._table(points, state, count, spacing, cutoff, velocity, braking, first_body)
        )

    def _table(
        self,
        points: FloatArray,
        state: Bodies,
        count: int,
        spacing: FloatArray,
        cutoff: float,
        velocity: FloatArray | None = None,
        braking: float = _NO_BRAKING,
        first_body: int = 0,
    ) -> tuple[FloatArray, IntArray]:
        """See `witnesses`, as a table of numbers and indices."""
        points = self._cloud(points)
        n_bodies, _, n_velocities = state.body_jacobians.shape
        if velocity is None:
            velocity = np.zeros(n_velocities)
        # Compiled code does not look whether an index is within an array.
        if count < 1 or spacing.shape != (n_bodies,) or velocity.shape != (n_velocities,):
            raise QueryError(
                f"expected count >= 1, {n_bodies} spacings and {n_velocities} velocities, got "
                f"{count}, {spacing.shape} and {velocity.shape}"
            )
        numbers, indices = self._empty_table(state, count)
        if len(points) and not find_witnesses(
            self._arrays,
            *self._work,
            points,
            state.link_poses,
            state.body_jacobians,
            velocity,
            first_body,
            cutoff,
            spacing,
            braking,
            numbers,
            indices,
        ):
            raise CloudError(_NOT_FINITE)
        return numbers, indices

    def floor_witnesses(self, state: RobotState) -> Witnesses:
        """Height of each body's lowest corner above the floor z = 0, one point a body.

        The floor is known, so it is no part of the cloud. The base stands on it: no point there.
        """
        numbers, indices = self._empty_table(state, 1)
        g = self._geometry
        find_lowest(
            g.vertices,
            g.vertex_start,
            state.link_poses,
            state.body_jacobians,
            _FIRST_ARM_BODY,
            numbers,
        )
        return Witnesses.from_table(numbers, indices)

    def no_witnesses(self, state: RobotState) -> Witnesses:
        """An answer without any point, one place a body."""
        return Witnesses.from_table(*self._empty_table(state, 1))

    def own_base_witnesses(
        self, state: RobotState, *, count: int, spacing: float, cutoff: float
    ) -> Witnesses:
        """Nearest points of the robot's own base for each body of the arm.

        The points ride on the base, so only the arm's joints change the distances. Links 1 and 2
        are mounted on the base and cannot reach it.

        Args:
            state: State of the robot.
            count: Points a body.
            spacing: Least distance between two points of a body [m].
            cutoff: Points farther than this from a body are left out [m].
        """
        points = placed_points(self._base_surface, self._base_only, state.link_poses[:1])
        found = self.witnesses(
            points,
            state,
            count=count,
            spacing=spacing,
            cutoff=cutoff,
            first_body=_FIRST_FREE_BODY,
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
        points = self._cloud(points)
        inside = np.zeros(len(points), dtype=np.bool_)
        if len(points) and not mark_within(
            self._arrays,
            *self._work,
            points,
            state.link_poses,
            _FIRST_ARM_BODY,
            tolerance,
            inside,
        ):
            raise CloudError(_NOT_FINITE)
        return inside

    def _cloud(self, points: FloatArray) -> FloatArray:
        """The points as the kernels want them, with work space for as many."""
        points = _cloud(points)
        if len(points) > len(self._work.listed):
            self._work = work_space(2 * len(points), len(self._geometry.faces))
        return points

    def _empty_table(self, state: Bodies, count: int) -> tuple[FloatArray, IntArray]:
        n_bodies, _, n_velocities = state.body_jacobians.shape
        return empty_table(n_bodies, count, n_velocities)


def _cloud(points: FloatArray) -> FloatArray:
    points = np.ascontiguousarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise CloudError(f"points: expected shape (N, 3), got {points.shape}")
    return points


def _checked(points: FloatArray) -> FloatArray:
    points = _cloud(points)
    if not np.isfinite(points).all():
        raise CloudError(_NOT_FINITE)
    return points
