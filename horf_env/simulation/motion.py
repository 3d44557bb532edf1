"""Motion over one control step, in two ways; both stop at the first contact.

Contact is checked so densely that no point of the robot moves farther between two checks than the
clearance found at the first, or `MIN_TRAVEL` if that is larger: in free space one check a step is
enough, and near an obstacle even a thin plate is not jumped over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import pybullet

from horf_env.robot.configuration import integrate
from horf_env.simulation.clearance import Clearance, ClearanceChecker
from horf_env.simulation.robot_body import RobotBody
from horf_env.types import FloatArray

MIN_TRAVEL = 0.02
"""Way of the fastest point between two checks in the neighbourhood of a contact [m]: no part of the
robot is thinner, so none passes a plate between two checks."""

# Part of the clearance that is used up before the next check: speeds change a little on the way.
_USABLE_CLEARANCE = 0.9
# Longest step of the physics engine [s], PyBullet's own default.
_PHYSICS_STEP = 1.0 / 240.0
# Speed [m/s] below which the robot counts as standing: avoids a division by zero.
_STANDING = 1e-9


@dataclass(frozen=True)
class MoveResult:
    """What became of a commanded motion.

    Attributes:
        configuration: Where the robot is now, shape (10,), m and rad.
        velocity: How fast it moves now, shape (9,), m/s and rad/s.
        clearance: The least clearance at any check, start and end included.
        final: The clearance where the robot is now.
    """

    configuration: FloatArray
    velocity: FloatArray
    clearance: Clearance
    final: Clearance

    @property
    def contact(self) -> tuple[str, str] | None:
        """The two bodies that touch, or None."""
        return self.clearance.bodies if self.clearance.is_contact else None


Move = Callable[[RobotBody, ClearanceChecker, Clearance, FloatArray, float], MoveResult]


def move_kinematic(
    robot: RobotBody,
    checker: ClearanceChecker,
    before: Clearance,
    velocity: FloatArray,
    duration: float,
) -> MoveResult:
    """Follow the velocity exactly: the base on its circular arc, the joints up to their limits.

    Args:
        robot: The robot at the start of the motion.
        checker: Tells its clearance.
        before: Its clearance at the start.
        velocity: Shape (9,), m/s and rad/s.
        duration: In s.
    """
    start = robot.configuration()
    robot.set_state(start, velocity)
    motion = robot.motion()
    least = clearance = before
    configuration, elapsed = start, 0.0
    while elapsed < duration and not least.is_contact:
        elapsed = min(elapsed + _travel(clearance) / max(motion.speed, _STANDING), duration)
        configuration = robot.within_joint_limits(integrate(start, velocity, elapsed))
        robot.set_state(configuration, velocity)
        motion = robot.motion()
        clearance = checker.check(motion.centres)
        least = _nearer(least, clearance)
    return MoveResult(configuration, velocity.copy(), least, clearance)


def move_dynamic(
    robot: RobotBody,
    checker: ClearanceChecker,
    before: Clearance,
    velocity: FloatArray,
    duration: float,
) -> MoveResult:
    """Let velocity motors with limited forces follow the velocity in the physics engine.

    There is no gravity (PyBullet's default), which is what the gravity compensation of the real
    arm's controller amounts to; the base is held on the plane by its joints.

    Args:
        robot: The robot at the start of the motion.
        checker: Tells its clearance.
        before: Its clearance at the start.
        velocity: Shape (9,), m/s and rad/s.
        duration: In s.
    """
    steps = ceil(duration / _PHYSICS_STEP - 1e-9)
    pybullet.setTimeStep(duration / steps, physicsClientId=robot.client)
    least = clearance = before
    travelled = 0.0
    for k in range(steps):
        if least.is_contact:
            break
        robot.command(velocity)
        pybullet.stepSimulation(physicsClientId=robot.client)
        motion = robot.motion()
        travelled += motion.speed * duration / steps
        # One more physics step may take the robot up to MIN_TRAVEL farther.
        if travelled >= _travel(clearance) - MIN_TRAVEL or k == steps - 1:
            clearance, travelled = checker.check(motion.centres), 0.0
            least = _nearer(least, clearance)
    return MoveResult(*robot.state(), least, clearance)


def _travel(clearance: Clearance) -> float:
    return max(_USABLE_CLEARANCE * clearance.distance, MIN_TRAVEL)


def _nearer(a: Clearance, b: Clearance) -> Clearance:
    return b if b.distance < a.distance else a


MODES: dict[str, Move] = {"kinematic": move_kinematic, "dynamic": move_dynamic}
"""Ways to simulate, by the name that users give."""
