"""Pictures of robot and scene for people, by PyBullet's software renderer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pybullet
from numpy.typing import NDArray

from horf_env.scenes.scene import Scene
from horf_env.simulation.loading import RobotFile, connect, load_robot, movable_joints
from horf_env.types import FloatArray

_FLOOR_COLOUR = (0.85, 0.85, 0.83, 1.0)
_OBSTACLE_COLOUR = (0.55, 0.42, 0.30, 1.0)
_GOAL_COLOUR = (0.85, 0.10, 0.10, 1.0)
_GOAL_RADIUS = 0.05  # m, as large as a fist
_FLOOR_HALF_EXTENTS = (30.0, 30.0, 0.01)  # m, beyond the walls of all scenes
_TARGET_HEIGHT = 0.5  # m, about the middle of the robot
_NEAR, _FAR = 0.05, 50.0  # m, what is drawn


@dataclass(frozen=True)
class Viewpoint:
    """A camera that looks at the robot and follows it.

    Attributes:
        distance: From the base [m].
        yaw: Direction of view about the vertical axis, 0 = along the world's y axis [degrees].
        pitch: Direction of view above the horizon [degrees].
        field_of_view: Vertical [degrees].
    """

    distance: float = 3.0
    yaw: float = -60.0
    pitch: float = -40.0
    field_of_view: float = 60.0


class SceneRenderer:
    """One scene with the robot's visual meshes, in a physics server of its own.

    Nothing here takes part in the simulation, so a run without pictures loads no visual mesh.
    """

    def __init__(self, file: RobotFile, scene: Scene) -> None:
        """Load everything."""
        self._client = connect()
        self._robot = load_robot(self._client, file, visuals=True)
        self._joints = movable_joints(self._client, self._robot)
        _draw_scene(self._client, scene)

    def render(
        self, configuration: FloatArray, *, width: int, height: int, viewpoint: Viewpoint
    ) -> NDArray[np.uint8]:
        """Draw the robot at a configuration.

        Args:
            configuration: Shape (10,), m and rad.
            width: Columns of the picture.
            height: Rows of the picture.
            viewpoint: From where.

        Returns:
            Shape (height, width, 3), RGB.
        """
        pybullet.resetJointStatesMultiDof(
            self._robot, self._joints, configuration[:, None].tolist(), physicsClientId=self._client
        )
        view = pybullet.computeViewMatrixFromYawPitchRoll(
            cameraTargetPosition=(configuration[0], configuration[1], _TARGET_HEIGHT),
            distance=viewpoint.distance,
            yaw=viewpoint.yaw,
            pitch=viewpoint.pitch,
            roll=0.0,
            upAxisIndex=2,
        )
        projection = pybullet.computeProjectionMatrixFOV(
            viewpoint.field_of_view, width / height, _NEAR, _FAR
        )
        image = pybullet.getCameraImage(
            width,
            height,
            view,
            projection,
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        return np.asarray(image[2], dtype=np.uint8).reshape(height, width, 4)[..., :3].copy()

    def close(self) -> None:
        """Free the physics server."""
        pybullet.disconnect(physicsClientId=self._client)


def _draw_scene(client: int, scene: Scene) -> None:
    x, y, _ = scene.start.base
    floor = _shape(client, _FLOOR_COLOUR, pybullet.GEOM_BOX, halfExtents=_FLOOR_HALF_EXTENTS)
    _place(client, floor, (x, y, -_FLOOR_HALF_EXTENTS[2]))
    for box in scene.boxes:
        shape = _shape(client, _OBSTACLE_COLOUR, pybullet.GEOM_BOX, halfExtents=box.half_extents)
        _place(client, shape, box.center, yaw=box.yaw)
    for cylinder in scene.cylinders:
        size = {"radius": cylinder.radius, "length": 2.0 * cylinder.half_height}
        _place(
            client,
            _shape(client, _OBSTACLE_COLOUR, pybullet.GEOM_CYLINDER, **size),
            cylinder.center,
        )
    for sphere in scene.spheres:
        shape = _shape(client, _OBSTACLE_COLOUR, pybullet.GEOM_SPHERE, radius=sphere.radius)
        _place(client, shape, sphere.center)
    goal = _shape(client, _GOAL_COLOUR, pybullet.GEOM_SPHERE, radius=_GOAL_RADIUS)
    _place(client, goal, scene.goal.position)


def _shape(client: int, colour: tuple[float, ...], kind: int, **size: object) -> int:
    shape: int = pybullet.createVisualShape(kind, rgbaColor=colour, physicsClientId=client, **size)
    return shape


def _place(
    client: int, shape: int, position: tuple[float, float, float], *, yaw: float = 0.0
) -> None:
    pybullet.createMultiBody(
        baseVisualShapeIndex=shape,
        basePosition=position,
        baseOrientation=pybullet.getQuaternionFromEuler((0.0, 0.0, yaw)),
        physicsClientId=client,
    )
