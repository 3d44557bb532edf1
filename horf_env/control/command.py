"""What an action layer gets and gives."""

from __future__ import annotations

from dataclasses import dataclass

from horf_env.control.qp import QpSolution
from horf_env.robot import RobotState
from horf_env.sdf import Witnesses
from horf_env.types import FloatArray


@dataclass(frozen=True)
class Sensed:
    """What an action layer may know at one tick.

    Attributes:
        state: State of the robot.
        velocity: Velocity that the last tick commanded, shape (9,), m/s and rad/s.
        points: Obstacle points in the world, shape (N, 3), m.
        unseen: Ground near the base that was neither seen nor covered, shape (M, 2), m.
        position_error: Distance of the end effector from the goal [m].
        posture: Joints that the arm goes back to where the action leaves it free, shape (7,), rad.
    """

    state: RobotState
    velocity: FloatArray
    points: FloatArray
    unseen: FloatArray
    position_error: float
    posture: FloatArray


@dataclass(frozen=True)
class Command:
    """What an action layer decided.

    Attributes:
        velocity: Shape (9,), m/s and rad/s.
        twist: EE twist that was asked for, in base axes, shape (6,), m/s and rad/s.
        obstacles: Witness points that the layer looked at; None if it looks at none.
        qp: Answer of the QP; None for a layer without one.
    """

    velocity: FloatArray
    twist: FloatArray
    obstacles: Witnesses | None = None
    qp: QpSolution | None = None
