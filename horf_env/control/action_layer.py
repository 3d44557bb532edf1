"""Action layers: how an action in [-1, 1] becomes a velocity of base and arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from horf_env.control.presets import ControlPreset
from horf_env.control.qp import QpSolution
from horf_env.control.tick import ControlTick
from horf_env.errors import UnknownNameError
from horf_env.robot import LimitsProfile, RobotState
from horf_env.sdf import RobotSdf, Witnesses
from horf_env.types import N_VELOCITIES, FloatArray

_OWN_BASE_CUTOFF = 0.5  # m; farther away the arm cannot reach its own base within a tick


@dataclass(frozen=True)
class Sensed:
    """What an action layer may know at one tick.

    Attributes:
        state: State of the robot.
        velocity: Velocity of the last tick, shape (9,), m/s and rad/s.
        points: Obstacle points in the world, shape (N, 3), m.
        position_error: Distance of the end effector from the goal [m].
    """

    state: RobotState
    velocity: FloatArray
    points: FloatArray
    position_error: float


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


class ActionLayer(Protocol):
    """Turns an action into a velocity."""

    action_size: int

    def command(self, action: FloatArray, sensed: Sensed) -> Command:
        """Decide the velocity of this tick.

        Args:
            action: In [-1, 1], shape (action_size,).
            sensed: What is known.
        """


class SdfQpLayer:
    """The action is an EE twist; the SDF-constrained QP follows it (HORF, HRA, HFSS)."""

    action_size = 6

    def __init__(
        self, sdf: RobotSdf, limits: LimitsProfile, preset: ControlPreset, dt: float
    ) -> None:
        self._sdf, self._limits, self._preset, self._dt = sdf, limits, preset, dt
        self._qp = preset.whole_body_qp()

    def command(self, action: FloatArray, sensed: Sensed) -> Command:
        """See `ActionLayer`."""
        tick = self.tick(action * self._limits.twist_scale, sensed)
        solution = self._qp.solve(tick)
        return Command(solution.velocity, tick.twist, tick.obstacles, solution)

    def tick(self, twist: FloatArray, sensed: Sensed) -> ControlTick:
        """Inputs of the QP: witness points of obstacles, floor and own base."""
        preset, state = self._preset, sensed.state
        obstacles = self._sdf.witnesses(
            sensed.points,
            state,
            count=preset.witnesses,
            spacing=preset.spacing,
            cutoff=preset.influence,
            velocity=sensed.velocity,
            braking=self._limits.braking,
        )
        return ControlTick(
            state=state,
            velocity=sensed.velocity,
            twist=twist,
            position_error=sensed.position_error,
            obstacles=obstacles,
            floor=self._sdf.floor_witnesses(state),
            own_base=self._sdf.own_base_witnesses(state, cutoff=_OWN_BASE_CUTOFF),
            limits=self._limits,
            dt=self._dt,
        )


class JointVelocityLayer:
    """The action is the velocity itself, scaled to the limits; nothing is avoided (RLMM)."""

    action_size = N_VELOCITIES

    def __init__(
        self, sdf: RobotSdf, limits: LimitsProfile, preset: ControlPreset, dt: float
    ) -> None:
        self._limits, self._dt = limits, dt

    def command(self, action: FloatArray, sensed: Sensed) -> Command:
        """See `ActionLayer`."""
        change = self._limits.acceleration * self._dt
        wanted = action * self._limits.velocity
        velocity = np.clip(wanted, sensed.velocity - change, sensed.velocity + change)
        return Command(velocity, sensed.state.ee_jacobian @ wanted)


_Factory = Callable[[RobotSdf, LimitsProfile, ControlPreset, float], ActionLayer]

ACTION_LAYERS: dict[str, _Factory] = {
    "sdf_qp": SdfQpLayer,
    "joint_velocity": JointVelocityLayer,
}


def action_layer(
    name: str, sdf: RobotSdf, limits: LimitsProfile, preset: ControlPreset, dt: float
) -> ActionLayer:
    """Make the layer of that name.

    Raises:
        UnknownNameError: If there is none.
    """
    if name not in ACTION_LAYERS:
        raise UnknownNameError("action layer", name, ACTION_LAYERS)
    return ACTION_LAYERS[name](sdf, limits, preset, dt)
