"""What the last image shows beyond the local map: enough to choose a way, not to drive by."""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.perception.camera import CameraModel, DepthImage
from horf_env.perception.cloud import remove_floor
from horf_env.perception.thinning import ring
from horf_env.types import BoolArray, FloatArray

# Distance on the ground from which on points count [m]: the local map ends at 3 m, and the arm does
# not reach so far.
_NEAREST = 2.9
_FLOOR = 0.05  # m; what is lower is the floor
_BEFORE = 0.05  # m; what is so near to a surface that was measured may be a part of it


class FarView:
    """The last image, as it was taken."""

    def __init__(self, model: CameraModel) -> None:
        """Nothing is shown.

        Args:
            model: The camera.
        """
        self._model = model
        self.take_in(np.zeros((model.height, model.width), np.float32), np.empty((0, 3)), np.eye(4))

    def take_in(self, depth: DepthImage, points: FloatArray, T_world_camera: FloatArray) -> None:
        """Replace the last image.

        Args:
            depth: Depth in m, shape (H, W); 0 = nothing measured.
            points: What it shows, in the world, shape (N, 3), m.
            T_world_camera: Pose of the camera, shape (4, 4).
        """
        self._depth, self._points, self._T_world_camera = depth, points, T_world_camera

    def surfaces(self, place: FloatArray) -> FloatArray:
        """Points of surfaces beyond the local map around a place (2,), in the world, (N, 3), m."""
        return remove_floor(ring(self._points, place, _NEAREST, np.inf), height=_FLOOR)

    def seen(self, points: FloatArray) -> BoolArray:
        """Which of the points (N, 3) [m] are in view with nothing before them, shape (N,).

        Where nothing was measured the view is taken to be free as far as the camera measures: it
        mostly is, and a way is the only thing that is chosen by it.
        """
        rays = self._model.focal_lengths
        return np.asarray(
            _in_view(points, self._T_world_camera, self._depth, rays, self._model.far)
        )


@njit(cache=True)
def _in_view(
    points: FloatArray, T: FloatArray, depth: DepthImage, focal: tuple[float, float], far: float
) -> BoolArray:
    """See `FarView.seen`."""
    rows, columns = depth.shape
    seen = np.zeros(len(points), dtype=np.bool_)
    for k in range(len(points)):
        x, y, z = points[k, 0] - T[0, 3], points[k, 1] - T[1, 3], points[k, 2] - T[2, 3]
        ahead = T[0, 2] * x + T[1, 2] * y + T[2, 2] * z
        if ahead <= 0.0:
            continue
        right = T[0, 0] * x + T[1, 0] * y + T[2, 0] * z
        down = T[0, 1] * x + T[1, 1] * y + T[2, 1] * z
        i = int(np.floor(0.5 * rows + focal[1] * down / ahead))
        j = int(np.floor(0.5 * columns + focal[0] * right / ahead))
        if 0 <= i < rows and 0 <= j < columns:
            measured = depth[i, j] if depth[i, j] > 0.0 else far
            seen[k] = ahead < measured - _BEFORE
    return seen
