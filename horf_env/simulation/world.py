"""The world that the robot moves in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pybullet
from numpy.typing import NDArray

from horf_env.errors import HorfEnvError, UnknownNameError
from horf_env.scenes.scene import Scene
from horf_env.simulation.clearance import Clearance, ClearanceChecker
from horf_env.simulation.loading import RobotFile, connect
from horf_env.simulation.motion import MODES, MoveResult
from horf_env.simulation.rendering import SceneRenderer, Viewpoint
from horf_env.simulation.robot_body import RobotBody
from horf_env.types import FloatArray

# Passes over the motors of a physics step. With PyBullet's 50 those of the base and of the arm's
# first joint, whose axes are parallel, are not done with each other: it drifts by 12 mrad in 4 s.
_SOLVER_ITERATIONS = 200


class WorldNotReadyError(HorfEnvError, RuntimeError):
    """The world has no scene (yet), or has been closed."""


@dataclass(frozen=True)
class WorldState:
    """Everything that the next motion depends on, besides the scene.

    Attributes:
        configuration: Shape (10,), m and rad.
        velocity: Shape (9,), m/s and rad/s.
    """

    configuration: FloatArray
    velocity: FloatArray


@dataclass(frozen=True)
class _Contents:
    scene: Scene
    robot: RobotBody
    checker: ClearanceChecker


class PyBulletWorld:
    """A robot among the obstacles of one scene, in a physics server of its own."""

    def __init__(self, *, mode: str = "kinematic") -> None:
        """An empty world.

        Args:
            mode: "kinematic" (exact) or "dynamic" (velocity motors).

        Raises:
            UnknownNameError: If there is no such mode.
            MissingAssetError: If the Panda's meshes are not installed.
        """
        if mode not in MODES:
            raise UnknownNameError("simulation mode", mode, MODES)
        self._move = MODES[mode]
        self._file = RobotFile()
        self._client = connect()
        self._contents: _Contents | None = None
        self._clearance: Clearance | None = None  # where the robot is now, once it is known
        self._renderer: SceneRenderer | None = None
        self._open = True

    def set_scene(self, scene: Scene) -> None:
        """Replace the scene and put the robot at its start, at rest.

        The simulation is built anew each time. That takes about 20 ms, leaves nothing of the last
        scene behind that could change a result, and is the only way for PyBullet to free a shape.

        Raises:
            WorldNotReadyError: If the world has been closed.
        """
        if not self._open:
            raise WorldNotReadyError("the world is closed: make a new one")
        self._close_renderer()
        pybullet.resetSimulation(physicsClientId=self._client)  # of these settings, too
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=_SOLVER_ITERATIONS, physicsClientId=self._client
        )
        robot = RobotBody(self._client, self._file)
        self._contents = _Contents(scene, robot, ClearanceChecker(robot, scene))
        start = np.array([*scene.start.base, *scene.start.arm])
        self.set_state(WorldState(start, np.zeros(9)))

    @property
    def state(self) -> WorldState:
        """State of the robot now.

        Raises:
            WorldNotReadyError: If there is no scene.
        """
        return WorldState(*self._ready.robot.state())

    def set_state(self, state: WorldState) -> None:
        """Put the robot somewhere.

        Raises:
            WorldNotReadyError: If there is no scene.
        """
        self._ready.robot.set_state(state.configuration, state.velocity)
        self._clearance = None

    @property
    def clearance(self) -> Clearance:
        """Clearance of the robot where it is now.

        Raises:
            WorldNotReadyError: If there is no scene.
        """
        contents = self._ready
        if self._clearance is None:
            self._clearance = contents.checker.check(contents.robot.motion().centres)
        return self._clearance

    def move(self, velocity: FloatArray, duration: float) -> MoveResult:
        """Move the robot from where it is, until the first contact at the latest.

        A robot that is in contact does not move at all.

        Args:
            velocity: Shape (9,), m/s and rad/s.
            duration: In s.

        Raises:
            WorldNotReadyError: If there is no scene.
        """
        contents = self._ready
        moved = self._move(contents.robot, contents.checker, self.clearance, velocity, duration)
        self._clearance = moved.final
        return moved

    def render_rgb(
        self, *, width: int = 640, height: int = 480, viewpoint: Viewpoint | None = None
    ) -> NDArray[np.uint8]:
        """Picture of robot, scene and goal, shape (height, width, 3). The first one takes longer.

        Raises:
            WorldNotReadyError: If there is no scene.
        """
        contents = self._ready
        if self._renderer is None:
            self._renderer = SceneRenderer(self._file, contents.scene)
        return self._renderer.render(
            contents.robot.configuration(),
            width=width,
            height=height,
            viewpoint=viewpoint or Viewpoint(),
        )

    def close(self) -> None:
        """Free the physics server. Closing twice is fine."""
        if self._open:
            self._close_renderer()
            pybullet.disconnect(physicsClientId=self._client)
            self._file.close()
        self._open, self._contents = False, None

    @property
    def _ready(self) -> _Contents:
        if self._contents is None:
            raise WorldNotReadyError("the world has no scene: call set_scene on an open world")
        return self._contents

    def _close_renderer(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
