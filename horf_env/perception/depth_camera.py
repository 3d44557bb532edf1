"""Depth images of the scene and the robot's own bodies, by ray casting."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from horf_env.perception.camera import CameraModel, DepthImage
from horf_env.perception.image_bounds import pixel_windows
from horf_env.perception.ray_casting import RayCaster
from horf_env.types import FloatArray


class DepthCamera:
    """Ideal depth camera.

    Ray casting is exact and needs no graphics driver. Surfaces are opaque from both sides. A body
    nearer than the camera can measure still hides what is behind it: its pixels are invalid.
    """

    def __init__(self, model: CameraModel) -> None:
        self.model = model
        self._rays = model.rays.astype(np.float32)
        self._scene: RayCaster | None = None
        self._bodies: list[RayCaster] = []
        self._corners, self._starts = np.empty((0, 3)), np.zeros(1, dtype=np.int64)

    def set_scene(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        """Replace the scene, floor included.

        Args:
            vertices: In the world frame, shape (V, 3), m.
            faces: Vertex indices of the triangles, shape (F, 3).

        Raises:
            ValueError: If the mesh is malformed.
        """
        self._scene = RayCaster(vertices, faces)

    def set_robot(self, meshes: Sequence[tuple[ArrayLike, ArrayLike]]) -> None:
        """Replace the robot's bodies. Leave out the one that contains the camera.

        Args:
            meshes: For each body (vertices (V, 3) in the body's frame [m], faces (F, 3)).

        Raises:
            ValueError: If a mesh is malformed.
        """
        self._bodies = [RayCaster(vertices, faces) for vertices, faces in meshes]
        corners = [np.asarray(vertices, dtype=float) for vertices, _ in meshes]
        self._corners = np.concatenate(corners)
        self._starts = np.cumsum([0, *map(len, corners)])

    def render(
        self, T_world_camera: FloatArray, T_world_bodies: FloatArray | Sequence[FloatArray] = ()
    ) -> DepthImage:
        """Take one image.

        Args:
            T_world_camera: Pose of the camera, shape (4, 4).
            T_world_bodies: Poses of the bodies in the order of `set_robot`, shape (B, 4, 4).

        Returns:
            Depth along the optical axis (not along the ray) in m, shape (H, W); 0 where nothing is
            hit between the camera's near and far limit.

        Raises:
            RuntimeError: If there is no scene yet.
            ValueError: If there are not as many poses as bodies.
        """
        if self._scene is None:
            raise RuntimeError("no scene to look at: call set_scene first")
        if len(T_world_bodies) != len(self._bodies):
            raise ValueError(
                f"T_world_bodies: expected {len(self._bodies)} poses, got {len(T_world_bodies)}"
            )
        rotation, position = T_world_camera[:3, :3], T_world_camera[:3, 3]
        # Rays end just beyond what the camera can measure.
        end = np.nextafter(np.float32(self.model.far), np.float32(np.inf))
        depth = np.full(self._rays.shape[:2], end)
        self._cast(self._scene, rotation, position, np.s_[:, :], depth)
        poses = np.asarray(T_world_bodies).reshape(-1, 4, 4)
        windows = pixel_windows(
            self._corners,
            self._starts,
            T_world_camera,
            poses,
            self.model.focal_lengths,
            depth.shape,
        )
        for k, (top, bottom, left, right) in enumerate(windows.tolist()):
            if top < bottom and left < right:
                to_body = poses[k, :3, :3].T
                place = to_body @ (position - poses[k, :3, 3])
                window = np.s_[top:bottom, left:right]
                self._cast(self._bodies[k], to_body @ rotation, place, window, depth)
        return self.model.within_range(depth)

    def _cast(
        self,
        caster: RayCaster,
        rotation: FloatArray,
        position: FloatArray,
        window: tuple[slice, slice],
        depth: DepthImage,
    ) -> None:
        """Lower the depth in a window of the image to the hits with one mesh.

        Rays have z = 1 in camera axes, so their parameter is the depth, in any rotated frame.
        Rotation and position are the camera's in the frame of the mesh.
        """
        rays = self._rays[window]
        directions = rays.reshape(-1, 3) @ rotation.T.astype(np.float32)
        hits = caster.cast(position, directions, depth[window].reshape(-1))
        depth[window] = hits.reshape(rays.shape[:2])
