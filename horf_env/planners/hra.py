"""Holistic reactive approach (HRA): a position servo above the SDF-constrained QP."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from horf_env.control import servo_twist
from horf_env.robot import LimitsProfile
from horf_env.types import FloatArray


class HraPlanner:
    """Point the end effector straight at the goal; the QP keeps it from hitting anything.

    The baseline of the paper's Table 1: Haviland's holistic controller with the SDF rows. It looks
    at the deviation alone, so it gets stuck where the way to the goal is not straight.
    """

    action_layer = "sdf_qp"

    def __init__(self) -> None:
        self._limits: LimitsProfile | None = None

    def reset(self, env: gym.Env[dict[str, np.ndarray], FloatArray]) -> None:
        """See `Planner`."""
        self._limits = env.unwrapped.get_wrapper_attr("limits")

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """See `Planner`.

        Raises:
            RuntimeError: If `reset` was not called.
        """
        if self._limits is None:
            raise RuntimeError("call reset(env) before act(observation)")
        scale = self._limits.twist_scale
        return servo_twist(observation["deviation"].astype(float), scale) / scale
