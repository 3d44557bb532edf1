"""Action layers whose action is an EE twist that the whole-body QP follows."""

from __future__ import annotations

import numpy as np

from horf_env.control.command import Command, Sensed
from horf_env.control.presets import ControlPreset
from horf_env.control.qp import WholeBodyQp
from horf_env.control.tick import ControlTick
from horf_env.robot import LimitsProfile, MobileManipulator, RobotState
from horf_env.sdf import RobotSdf, Witnesses
from horf_env.types import FloatArray

_OWN_BASE_CUTOFF = 0.5  # m; farther away the arm cannot reach its own base within a tick


class SdfQpLayer:
    """The SDF-constrained QP follows the twist (HORF, HRA, HFSS)."""

    action_size = 6

    def __init__(
        self, sdf: RobotSdf, limits: LimitsProfile, preset: ControlPreset, dt: float
    ) -> None:
        self._sdf, self._limits, self._preset, self._dt = sdf, limits, preset, dt
        self._qp = self._whole_body_qp()
        self._spacing = np.full(len(MobileManipulator.link_names), preset.spacing)
        self._spacing[0] = preset.base_spacing

    def command(self, action: FloatArray, sensed: Sensed) -> Command:
        """See `ActionLayer`."""
        tick = self.tick(action * self._limits.twist_scale, sensed)
        solution = self._qp.solve(tick)
        return Command(solution.velocity, tick.twist, tick.obstacles, solution)

    def tick(self, twist: FloatArray, sensed: Sensed) -> ControlTick:
        """Inputs of the QP: witness points of obstacles, floor and own base."""
        state = sensed.state
        return ControlTick(
            state=state,
            velocity=sensed.velocity,
            twist=twist,
            position_error=sensed.position_error,
            posture=sensed.posture,
            obstacles=self._obstacles(sensed),
            floor=self._sdf.floor_witnesses(state),
            own_base=self._own_base(state),
            unseen=sensed.unseen,
            limits=self._limits,
            dt=self._dt,
        )

    def _own_base(self, state: RobotState) -> Witnesses:
        if not self._preset.avoid_own_base:
            return self._sdf.no_witnesses(state)
        return self._sdf.own_base_witnesses(
            state,
            count=self._preset.own_base_witnesses,
            spacing=self._preset.spacing,
            cutoff=_OWN_BASE_CUTOFF,
        )

    def _whole_body_qp(self) -> WholeBodyQp:
        return self._preset.whole_body_qp()

    def _obstacles(self, sensed: Sensed) -> Witnesses:
        return self._sdf.witnesses(
            sensed.points,
            sensed.state,
            count=self._preset.witnesses,
            spacing=self._spacing,
            cutoff=self._preset.influence,
            velocity=sensed.velocity,
            braking=self._limits.braking,
        )
