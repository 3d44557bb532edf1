"""Senses of the robot: depth frames for the policy, obstacle points for the action layer."""

from __future__ import annotations

import numpy as np

from horf_env.errors import UnknownNameError
from horf_env.perception import (
    CameraModel,
    CloudHistory,
    DepthCamera,
    DisparityNoise,
    FrameStack,
    quantise_depth,
    remove_floor,
    unproject,
)
from horf_env.perception.camera import DepthImage
from horf_env.perception.thinning import thin
from horf_env.robot import ConvexPart, RobotState, collision_parts
from horf_env.scenes.scene import Scene
from horf_env.scenes.scene_mesh import triangles
from horf_env.scenes.surface_points import surface_points
from horf_env.sdf import RobotSdf
from horf_env.types import FloatArray

PERCEPTIONS = ("camera", "full")

_SELF_FILTER = 0.005  # m; depth is ideal and the arm is drawn as its hulls
_SELF_FILTER_NOISY = 0.03  # m; the D435's error at arm's length
# Within what the arm reaches [m from the base's centre] points are so dense that a finger tip
# cannot pass the margin of 0.05 m between two of them; farther away, where only braking matters,
# they are wider apart. Spacings in m.
_NEAR_RANGE, _NEAR_SPACING = 1.5, 0.03
_FAR_RANGE, _FAR_SPACING = 3.0, 0.08
# The same for the points of the five frames, which are thinned to one in each voxel [m].
_NEAR_VOXEL, _FAR_VOXEL = 0.02, 0.08
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
        depth_noise: bool,
    ) -> None:
        """Make the senses.

        Args:
            sdf: Distances of the robot, to tell its own arm from the world.
            camera: The depth camera.
            perception: "camera": the action layer gets the points of the last five frames; "full":
                it gets points on all obstacle surfaces, as if nothing were hidden.
            depth_noise: Whether images have the D435's disparity noise.

        Raises:
            UnknownNameError: If there is no such perception.
        """
        if perception not in PERCEPTIONS:
            raise UnknownNameError("perception", perception, PERCEPTIONS)
        self._sdf, self._model, self._full = sdf, camera, perception == "full"
        self._camera = DepthCamera(camera)
        # Not the base: the camera is inside its box and looks ahead.
        self._camera.set_robot([_joined(parts) for parts in collision_parts()[1:]])
        self._noise = DisparityNoise() if depth_noise else None
        self._tolerance = _SELF_FILTER_NOISY if depth_noise else _SELF_FILTER
        self._stack, self._cloud = FrameStack(), CloudHistory()
        self._near_surface = self._far_surface = self._around = np.empty((0, 3))
        self._centre = np.full(2, np.inf)
        self.depth: DepthImage = np.zeros((camera.height, camera.width), dtype=np.float32)

    def reset(self, scene: Scene, state: RobotState, rng: np.random.Generator) -> np.ndarray:
        """Look at a new scene for the first time.

        Returns:
            Stack of frames, shape (5, H, W), uint8.
        """
        self._camera.set_scene(*triangles(scene, floor=True))
        if self._full:
            self._near_surface = surface_points(scene, _NEAR_SPACING)
            self._far_surface = surface_points(scene, _FAR_SPACING)
            self._centre = np.full(2, np.inf)
        self._cloud.clear()
        return self._stack.reset(self._look(state, rng))

    def update(self, state: RobotState, rng: np.random.Generator) -> np.ndarray:
        """Take the next frame.

        Returns:
            Stack of frames, oldest first, shape (5, H, W), uint8.
        """
        return self._stack.push(self._look(state, rng))

    def points(self, state: RobotState) -> FloatArray:
        """Obstacle points for the action layer, in the world, shape (N, 3), m."""
        centre = state.T_world_base[:2, 3]
        if self._full:
            return self._true_points(centre)
        points = self._cloud.points()[::-1]  # newest first
        near = thin(_ring(points, centre, 0.0, _NEAR_RANGE), _NEAR_VOXEL)
        far = thin(_ring(points, centre, _NEAR_RANGE, _FAR_RANGE), _FAR_VOXEL)
        return np.concatenate([near, far])

    def _true_points(self, centre: FloatArray) -> FloatArray:
        """True surface points around the base, chosen anew only after it has moved."""
        if np.linalg.norm(centre - self._centre) > _RECENTRE:
            near = _ring(self._near_surface, centre, 0.0, _NEAR_RANGE)
            far = _ring(self._far_surface, centre, _NEAR_RANGE, _FAR_RANGE)
            self._centre, self._around = centre, np.concatenate([near, far])
        return self._around

    def _look(self, state: RobotState, rng: np.random.Generator) -> np.ndarray:
        T_world_camera = state.T_world_base @ self._model.T_base_camera
        depth = self._camera.render(T_world_camera, state.link_poses[1:])
        if self._noise is not None:
            depth = self._noise.apply(depth, self._model, rng)
        self.depth = depth
        if not self._full:
            points = remove_floor(unproject(depth, self._model, T_world_camera))
            own = self._sdf.on_arm(points, state, self._tolerance)
            self._cloud.add(points[~own])
        return quantise_depth(depth, self._model)


def _ring(points: FloatArray, centre: FloatArray, inner: float, outer: float) -> FloatArray:
    """Points whose horizontal distance from the centre is between two radii [m]."""
    x, y = points[:, 0] - centre[0], points[:, 1] - centre[1]
    squared = x * x + y * y
    return np.compress((squared >= inner * inner) & (squared < outer * outer), points, axis=0)


def _joined(parts: tuple[ConvexPart, ...]) -> tuple[FloatArray, np.ndarray]:
    """All parts of a body as one mesh."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    vertices = np.concatenate([part.vertices for part in parts])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=True)])
    return vertices, faces
