"""Senses of the robot: depth frames for the policy, obstacle points for the action layer."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from horf_env.errors import SettingError, UnknownNameError
from horf_env.perception import (
    CameraModel,
    DepthCamera,
    DisparityNoise,
    FarView,
    FrameStack,
    Image,
    MemorySettings,
    View,
    coarser,
    goal_space,
    quantise_depth,
    unproject,
)
from horf_env.perception.camera import DepthImage
from horf_env.perception.thinning import ring
from horf_env.robot import ConvexPart, RobotState, collision_parts
from horf_env.robot.placing import placed_points
from horf_env.robot.vectors import norm
from horf_env.scenes.scene import Scene
from horf_env.scenes.scene_mesh import triangles
from horf_env.scenes.surface_points import surface_points
from horf_env.sdf import RobotSdf
from horf_env.types import BoolArray, FloatArray

PERCEPTIONS = ("camera", "full")

Receive = Callable[[Image], Image | None]
"""What arrives when an image is captured: that one, another one, or none."""

_SELF_FILTER = 0.005  # m; depth is ideal and the arm is drawn as its hulls
_SELF_FILTER_NOISY = 0.03  # m; the D435's error at arm's length
# Spacing of the true surface points [m]: within what the arm reaches [m from the base's centre]
# they are so dense that a finger tip cannot pass the margin of 0.05 m between two of them; farther
# away, where only braking matters, they are wider apart.
_NEAR_RANGE, _NEAR_SPACING = 1.5, 0.03
_FAR_RANGE, _FAR_SPACING = 3.0, 0.08
# Spacing of the points that fill the arm [m]: less than a voxel of the map.
_FILLING = 0.04
# The base may move this far [m] before the true points around it are chosen anew.
_RECENTRE = 0.1


class Senses:
    """Camera, frame stack and point cloud of one robot."""

    def __init__(
        self,
        sdf: RobotSdf,
        camera: CameraModel,
        *,
        perception: str,
        memory: MemorySettings,
        depth_noise: bool,
        image: tuple[int, int] | None = None,
    ) -> None:
        """Make the senses.

        Args:
            sdf: Distances of the robot, to tell its own arm from the world.
            camera: The depth camera.
            perception: "camera": the action layer gets what the camera has shown; "full": it gets
                points on all obstacle surfaces, as if nothing were hidden.
            memory: How what the camera has shown is remembered.
            depth_noise: Whether images have the D435's disparity noise.
            image: Width and height of the frames for the policy; those of the camera without it.

        Raises:
            UnknownNameError: If there is no such perception.
            SettingError: If the frames for the policy have more pixels than the camera, or the
                memory is none.
        """
        if perception not in PERCEPTIONS:
            raise UnknownNameError("perception", perception, PERCEPTIONS)
        if not hasattr(memory, "make"):
            raise SettingError("memory", memory, "MapSettings or FrameSettings")
        self._sdf, self._model, self._full = sdf, camera, perception == "full"
        self._camera = DepthCamera(camera)
        self._pixels = coarser(camera, image or (camera.width, camera.height))
        parts = collision_parts()[1:]
        # Not the base: the camera is inside its box and looks ahead.
        self._camera.set_robot([_joined(p) for p in parts])
        inner = [_filling(sdf, body, _corners(p)) for body, p in enumerate(parts, start=1)]
        self._inner, self._inner_starts = np.concatenate(inner), np.cumsum([0, *map(len, inner)])
        self._noise = DisparityNoise() if depth_noise else None
        self._tolerance = _SELF_FILTER_NOISY if depth_noise else _SELF_FILTER
        self._stack, self.memory = FrameStack(), memory.make()
        self._far_view = FarView(camera)
        self._near_surface = self._far_surface = self._around = np.empty((0, 3))
        self._centre = np.full(2, np.inf)
        self.depth: DepthImage = np.zeros((camera.height, camera.width), dtype=np.float32)

    def reset(
        self, scene: Scene, state: RobotState, rng: np.random.Generator, receive: Receive
    ) -> np.ndarray:
        """Look at a new scene for the first time; this image arrives in any case.

        Args:
            scene: The scene.
            state: State of the robot.
            rng: Source of the noise.
            receive: What arrives when an image is captured.

        Returns:
            Stack of frames, shape (5, H, W), uint8.
        """
        self._camera.set_scene(*triangles(scene, floor=True))
        if self._full:
            self._near_surface = surface_points(scene, _NEAR_SPACING)
            self._far_surface = surface_points(scene, _FAR_SPACING)
            self._centre = np.full(2, np.inf)
        self.memory.reset(state.T_world_base, goal_space(scene.goal.pose))
        image = self._capture(state, rng, 0.0)
        self._take_in(receive(image) or image)
        return self._stack.reset(self._frame())

    def update(
        self, state: RobotState, rng: np.random.Generator, time: float, receive: Receive
    ) -> np.ndarray:
        """Look again, at a time since the start of the episode [s]; see `reset`.

        Returns:
            Stack of frames, oldest first, shape (5, H, W), uint8; without a new image the last one
            is repeated.
        """
        image = receive(self._capture(state, rng, time))
        if image is not None:
            self._take_in(image)
        if not self._full:
            self.memory.occupy(state.T_world_base, self.arm_points(state))
        return self._stack.push(self._frame())

    def _frame(self) -> np.ndarray:
        """The last image as the policy sees it."""
        return quantise_depth(self.depth[self._pixels], self._model)

    def points(self, state: RobotState) -> FloatArray:
        """Obstacle points for the action layer, in the world, shape (N, 3), m."""
        if self._full:
            return self._true_points(state.T_world_base[:2, 3])
        return self.memory.points(state.T_world_base)

    def surfaces(self, place: FloatArray) -> FloatArray:
        """See `SeenSpace`: of all surfaces there are, or of those the camera has shown."""
        if self._full:
            return self._true_points(place)
        return np.concatenate([self.memory.surfaces(place), self._far_view.surfaces(place)])

    def seen(self, points: FloatArray) -> BoolArray:
        """See `SeenSpace`."""
        if self._full:
            return np.hypot(*(points[:, :2] - self._centre).T) < _FAR_RANGE
        return self.memory.seen(points) | self._far_view.seen(points)

    def presume(self, behind: float) -> None:
        """See `SeenSpace`."""
        self.memory.presume(behind)

    def unseen_ground(self, state: RobotState) -> FloatArray:
        """Ground that nobody has looked at, in the world, shape (M, 2), m."""
        if self._full:
            return np.empty((0, 2))
        return self.memory.unseen(state.T_world_base)

    def _true_points(self, centre: FloatArray) -> FloatArray:
        """True surface points around the base, chosen anew only after it has moved."""
        if norm(centre - self._centre) > _RECENTRE:
            near = ring(self._near_surface, centre, 0.0, _NEAR_RANGE)
            far = ring(self._far_surface, centre, _NEAR_RANGE, _FAR_RANGE)
            self._centre, self._around = centre, np.concatenate([near, far])
        return self._around

    def _capture(self, state: RobotState, rng: np.random.Generator, time: float) -> Image:
        T_world_camera = state.T_world_base @ self._model.T_base_camera
        depth = self._camera.render(T_world_camera, state.link_poses[1:])
        if self._noise is not None:
            depth = self._noise.apply(depth, self._model, rng)
        return Image(depth, self._model, state, time)

    def arm_points(self, state: RobotState) -> FloatArray:
        """Points that fill the arm, in the world, shape (N, 3), m."""
        return placed_points(self._inner, self._inner_starts, state.link_poses[1:])

    def _take_in(self, image: Image) -> None:
        self.depth = image.depth
        if self._full:
            return
        T_world_camera = image.state.T_world_base @ self._model.T_base_camera
        points = unproject(image.depth, self._model, T_world_camera)
        own = self._sdf.on_arm(points, image.state, self._tolerance)
        self.memory.add(View(image, T_world_camera, points, own))
        self._far_view.take_in(image.depth, points, T_world_camera)


def _joined(parts: tuple[ConvexPart, ...]) -> tuple[FloatArray, np.ndarray]:
    """All parts of a body as one mesh."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    vertices = np.concatenate([part.vertices for part in parts])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)])
    return vertices, faces


def _corners(parts: tuple[ConvexPart, ...]) -> FloatArray:
    return np.concatenate([part.vertices for part in parts])


def _filling(sdf: RobotSdf, body: int, corners: FloatArray) -> FloatArray:
    """Points in a body, on a grid in its own frame, shape (N, 3), m."""
    axes = [
        np.arange(low + 0.5 * _FILLING, high, _FILLING)
        for low, high in zip(corners.min(axis=0), corners.max(axis=0), strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[sdf.link_distance(body, grid) < 0.0]
