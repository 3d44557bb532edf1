"""Rolling voxel map around the robot: what the camera has seen, and what it has not.

Not in the paper, whose cloud is that of the last five frames. On a level field of view of 87 x 58
degrees most of what the robot hits was seen and forgotten, or is behind or above what it saw.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from horf_env.perception.ground import mark_points, mark_robot, points_seen, unseen_ground
from horf_env.perception.hidden import hidden_space, obstacle_points
from horf_env.perception.memory import View
from horf_env.perception.rays import take_in
from horf_env.perception.voxel_grid import empty_grid, move_window, near_points
from horf_env.robot.footprint import BASE_HEIGHT, FOOTPRINT
from horf_env.settings import check_not_negative, check_positive, check_unbounded
from horf_env.types import BoolArray, FloatArray

# The window follows when the robot has moved this far [m] from its middle.
_RECENTRE = 0.5
_MOST_POINTS = 1 << 15
_GROUND_RANGE = 2.0  # m from the base's centre; unseen ground farther away is no concern yet


@dataclass(frozen=True)
class MapSettings:
    """Settings of the local map.

    Attributes:
        voxel: Edge of a voxel [m].
        columns: Voxels along each side of the window, a power of two.
        layers: Voxels from the floor up, 63 at most: higher than the arm reaches.
        history: How long a point is remembered after it was last seen [s]; inf for ever.
        carving: Whether points that the camera sees through are forgotten.
        fill_above: Whether unseen space right above an occupied voxel counts as occupied.
        plate: How far this reaches above what hangs [m], such as a table top: thicker things show
            their sides. inf to treat it as what stands.
        fill_behind: How far unseen space behind an occupied voxel counts as occupied [m]. More
            closes ways that are free, less hits sides that nobody has seen.
        free_goal: Whether the space of the hand at the goal counts as seen, see `goal_space`.
        guard_unseen_ground: Whether unseen ground is told to the control layer.
        near: Within this distance of the base all points are used [m], beyond every second one.
        far: Beyond this distance none is [m].
        start_radius: Ground about the start that is taken to be free [m]: the robot is put where
            it can turn on the spot with its arm in the ready pose, which reaches 0.65 m.
        grace: Unseen ground so near to ground that was seen counts as seen [m]. A base that turns
            on the spot sweeps 0.18 m beside it, which a camera on its front never sees.
    """

    voxel: float = 0.05
    columns: int = 128
    layers: int = 36
    history: float = np.inf
    carving: bool = True
    fill_above: bool = True
    plate: float = 0.1
    fill_behind: float = 0.15
    free_goal: bool = True
    guard_unseen_ground: bool = True
    near: float = 1.3
    far: float = 3.0
    start_radius: float = 0.75
    grace: float = 0.2

    def __post_init__(self) -> None:
        """Refuse what is no map.

        Raises:
            SettingError: If a number is out of its range.
        """
        check_positive(self, "voxel", "near", "far")
        check_unbounded(self, "history", "plate")
        check_not_negative(self, "fill_behind", "start_radius", "grace")

    def make(self) -> LocalMap:
        """An empty map."""
        return LocalMap(self)


class LocalMap:
    """Voxels that are seen free, seen occupied or unseen."""

    def __init__(self, settings: MapSettings) -> None:
        """An empty map.

        Raises:
            SettingError: If the number of columns is no power of two or there are too many layers.
        """
        self._settings = settings
        self._body_layers = np.uint64((1 << int(np.ceil(BASE_HEIGHT / settings.voxel))) - 1)
        self._points = np.empty((_MOST_POINTS, 3))
        side = 2 * int(_GROUND_RANGE / settings.voxel)
        self._near_seen = np.zeros((2, side + 2, side + 2), dtype=np.uint8)
        self._ground = np.empty((side**2, 2))
        self._space = hidden_space(2 * round(settings.near / settings.voxel))
        self._plate = round(min(settings.plate / settings.voxel, settings.layers))
        self._grace = round(settings.grace / settings.voxel)
        self._make_grid()

    def _make_grid(self) -> None:
        s = self._settings
        self._grid = empty_grid(s.voxel, s.columns, s.layers)
        self._frames = 0

    def reset(self, T_world_base: FloatArray, free: FloatArray) -> None:
        """See `ObstacleMemory`."""
        self._make_grid()
        self.presume(self._settings.fill_behind)
        self._free = free if self._settings.free_goal else np.empty((0, 3))
        self._centre = (math.inf, math.inf)
        self._follow(T_world_base[:3, 3], 0.0)
        self._stand(T_world_base, self._settings.start_radius, np.empty((0, 3)))

    def add(self, view: View) -> None:
        """See `ObstacleMemory`."""
        image, model = view.image, view.image.model
        self._follow(view.T_world_camera[:3, 3], image.time)
        take_in(
            self._grid,
            view.points,
            view.own,
            image.depth,
            view.T_world_camera,
            model.focal_lengths,
            (model.near, model.far),
            self._settings.carving,
            self._frames,
            image.time,
        )
        self._frames += 1

    def _follow(self, place: FloatArray, time: float) -> None:
        """Move the window if need be, and forget what is too old."""
        x, y = float(place[0]), float(place[1])
        moved = max(abs(x - self._centre[0]), abs(y - self._centre[1])) > _RECENTRE
        if moved or math.isfinite(self._settings.history):
            self._centre = (x, y)
            move_window(self._grid, x, y, time - self._settings.history)
            mark_points(self._grid, self._free)

    def occupy(self, T_world_base: FloatArray, arm: FloatArray) -> None:
        """See `ObstacleMemory`."""
        self._stand(T_world_base, 0.0, arm)

    def points(self, T_world_base: FloatArray) -> FloatArray:
        """See `ObstacleMemory`."""
        s = self._settings
        return np.asarray(
            obstacle_points(
                self._grid,
                self._space,
                (T_world_base[0, 3], T_world_base[1, 3]),
                (s.near, s.far),
                self._body_layers,
                s.fill_above,
                self._plate,
                self._behind,
                self._points,
            )
        )

    def presume(self, behind: float) -> None:
        """See `ObstacleMemory`."""
        self._behind = round(behind / self._settings.voxel)

    def surfaces(self, place: FloatArray) -> FloatArray:
        """See `ObstacleMemory`."""
        x, y, far = float(place[0]), float(place[1]), self._settings.far
        found = near_points(self._grid, x, y, far, far, self._points)
        return self._points[:found].copy()

    def unseen(self, T_world_base: FloatArray) -> FloatArray:
        """See `ObstacleMemory`."""
        if not self._settings.guard_unseen_ground:
            return np.empty((0, 2))
        x, y = T_world_base[0, 3], T_world_base[1, 3]
        return np.asarray(
            unseen_ground(
                self._grid, x, y, self._body_layers, self._grace, self._near_seen, self._ground
            )
        )

    def seen(self, points: FloatArray) -> BoolArray:
        """See `ObstacleMemory`: those in voxels of the window that were seen, free or not."""
        return np.asarray(points_seen(self._grid, points))

    def _stand(self, T_world_base: FloatArray, radius: float, arm: FloatArray) -> None:
        theta = float(np.arctan2(T_world_base[1, 0], T_world_base[0, 0]))
        pose = (float(T_world_base[0, 3]), float(T_world_base[1, 3]), theta)
        mark_robot(self._grid, pose, FOOTPRINT, radius, self._body_layers, arm)
