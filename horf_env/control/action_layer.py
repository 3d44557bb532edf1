"""Action layers: how an action in [-1, 1] becomes a velocity of base and arm."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from horf_env.control.command import Command, Sensed
from horf_env.control.joint_velocity_layer import JointVelocityLayer
from horf_env.control.presets import ControlPreset
from horf_env.control.sampled_qp_layer import SampledQpLayer
from horf_env.control.sdf_qp_layer import SdfQpLayer
from horf_env.errors import UnknownNameError
from horf_env.robot import LimitsProfile
from horf_env.sdf import RobotSdf
from horf_env.types import FloatArray


class ActionLayer(Protocol):
    """Turns an action into a velocity."""

    action_size: int

    def command(self, action: FloatArray, sensed: Sensed) -> Command:
        """Decide the velocity of this tick.

        Args:
            action: In [-1, 1], shape (action_size,).
            sensed: What is known.
        """


_Factory = Callable[[RobotSdf, LimitsProfile, ControlPreset, float], ActionLayer]

ACTION_LAYERS: dict[str, _Factory] = {
    "sdf_qp": SdfQpLayer,
    "sampled_qp": SampledQpLayer,
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
