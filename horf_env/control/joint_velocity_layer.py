"""Action layer of RLMM: the action is the velocity itself."""

from __future__ import annotations

import numpy as np

from horf_env.control.command import Command, Sensed
from horf_env.control.presets import ControlPreset
from horf_env.robot import LimitsProfile
from horf_env.sdf import RobotSdf
from horf_env.types import N_VELOCITIES, FloatArray


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
