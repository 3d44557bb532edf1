"""Control layer: servo, limits, avoidance rows, whole-body QP."""

from horf_env.control.action_layer import ACTION_LAYERS, ActionLayer, action_layer
from horf_env.control.command import Command, Sensed
from horf_env.control.presets import PRESETS, ControlPreset, control_preset
from horf_env.control.qp import QpSolution, WholeBodyQp
from horf_env.control.servo import deviation, servo_twist
from horf_env.control.tick import ControlTick

__all__ = [
    "ACTION_LAYERS",
    "PRESETS",
    "ActionLayer",
    "Command",
    "ControlPreset",
    "ControlTick",
    "QpSolution",
    "Sensed",
    "WholeBodyQp",
    "action_layer",
    "control_preset",
    "deviation",
    "servo_twist",
]
