"""The layers of perception and control below an environment, one call each, for measuring them."""

from __future__ import annotations

import numpy as np

from horf_env.control import PRESETS, ControlTick, Sensed
from horf_env.control.sdf_qp_layer import SdfQpLayer
from horf_env.faults import Fault
from horf_env.perception import Image, MemorySettings
from horf_env.robot import ARM_READY, LIMITS
from horf_env.sdf import RobotSdf
from horf_env.sensing import Senses
from horf_env.task import STEP
from horf_env.types import FloatArray


class Listening(Fault):
    """Nothing goes wrong; keeps the image that was captured last."""

    def image(self, captured: Image) -> Image:
        """See `Fault`."""
        self.heard = captured
        return captured


class Chain:
    """Memory and action layer below an environment, fed with its images."""

    def __init__(self, sdf: RobotSdf, layer: type[SdfQpLayer], memory: MemorySettings) -> None:
        preset = PRESETS["default"]
        self.layer, self._sdf, self._memory = layer(sdf, LIMITS["ld60"], preset, STEP), sdf, memory

    def reset(self, image: Image) -> None:
        """Begin an episode with its first image."""
        self._senses = Senses(
            self._sdf, image.model, perception="camera", memory=self._memory, depth_noise=False
        )
        self._senses.memory.reset(image.state.T_world_base, np.empty((0, 3)))
        self.take_in(image)

    def take_in(self, image: Image) -> None:
        """Bring the memory up to date."""
        self._senses._take_in(image)
        points = self._senses.arm_points(image.state)
        self._senses.memory.occupy(image.state.T_world_base, points)

    def sense(self, image: Image, velocity: FloatArray, position_error: float) -> Sensed:
        """Ask the memory for points and unseen ground."""
        state = image.state
        points, unseen = self._senses.points(state), self._senses.unseen_ground(state)
        return Sensed(state, velocity, points, unseen, position_error, ARM_READY)

    def tick(self, action: FloatArray, sensed: Sensed) -> ControlTick:
        """Ask for all distances."""
        return self.layer.tick(action * LIMITS["ld60"].twist_scale, sensed)
