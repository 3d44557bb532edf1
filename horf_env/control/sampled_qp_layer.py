"""Action layer of HFBS: the same QP, but it knows the robot's shape by 40 points only."""

from __future__ import annotations

from horf_env.control.command import Sensed
from horf_env.control.presets import ControlPreset
from horf_env.control.qp import WholeBodyQp
from horf_env.control.sampled_dampers import SampledDampers
from horf_env.control.sdf_qp_layer import SdfQpLayer
from horf_env.robot import LimitsProfile, MobileManipulator
from horf_env.sdf import RobotSdf, Witnesses
from horf_env.sdf.body_samples import BodySamples

# Values of NEO's example; the paper names none.
_GAIN, _INFLUENCE, _STOPPING = 1.0, 0.3, 0.05  # m/s, m, m


class SampledQpLayer(SdfQpLayer):
    """Obstacle rows at sampled points; floor and own base as in `SdfQpLayer`."""

    def __init__(
        self, sdf: RobotSdf, limits: LimitsProfile, preset: ControlPreset, dt: float
    ) -> None:
        self._samples = BodySamples.load(MobileManipulator.load())
        super().__init__(sdf, limits, preset, dt)

    def _whole_body_qp(self) -> WholeBodyQp:
        dampers = SampledDampers(
            lambda tick: tick.obstacles,
            bodies=MobileManipulator.link_names,
            count=self._samples.count,
            gain=_GAIN,
            influence=_INFLUENCE,
            stopping=_STOPPING,
        )
        return self._preset.whole_body_qp(dampers)

    def _obstacles(self, sensed: Sensed) -> Witnesses:
        return self._samples.witnesses(sensed.points, sensed.state)
