"""Control layer: servo, limits, avoidance rows, whole-body QP."""

from horf_env.control.presets import PRESETS, ControlPreset, control_preset
from horf_env.control.qp import QpSolution, WholeBodyQp
from horf_env.control.servo import deviation, servo_twist
from horf_env.control.tick import ControlTick

__all__ = [
    "PRESETS",
    "ControlPreset",
    "ControlTick",
    "QpSolution",
    "WholeBodyQp",
    "control_preset",
    "deviation",
    "servo_twist",
]
