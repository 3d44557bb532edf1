"""What is measured while an episode runs, beyond what the environment tells at its end.

Definitions that the paper leaves open:

- Planning time of a tick: wall time of the planner's decision and of the action layer (SDF query
  and QP). Perception and simulation are not in it.
- Jerk: third difference of the end effector's position, root mean square over the episode.
- Stuck: the time was over, and the end effector had moved less than 5 cm in the last 5 s.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from horf_env.env import HorfReachEnv
from horf_env.planners import Planner
from horf_env.task import STEP
from horf_env.types import FloatArray

_STUCK_STEPS = 100  # 5 s
_STUCK_DISTANCE = 0.05  # m
_MILLISECONDS = 1e3


@dataclass(frozen=True)
class Measurements:
    """What came of an episode's measurements.

    Attributes:
        planning_time: Sum of the planning times of all ticks [s].
        planning_p50: Median planning time of a tick [ms].
        planning_p99: 99th percentile [ms].
        jerk_ee: RMS jerk of the end effector [m/s^3]; 0 in an episode of less than three steps.
        min_distance: Least clearance [m].
        unsolved: Ticks in which the QP was not solved and the robot braked.
        stands_still: Whether the end effector moved less than 5 cm in the last 5 s.
    """

    planning_time: float
    planning_p50: float
    planning_p99: float
    jerk_ee: float
    min_distance: float
    unsolved: int
    stands_still: bool


class Meter:
    """Watches one episode, tick by tick."""

    def __init__(self, env: HorfReachEnv) -> None:
        """Start at the environment's reset."""
        self._env = env
        self._decision_time = 0.0
        self._times: list[float] = []
        self._positions: list[FloatArray] = [env.record.state.T_world_ee[:3, 3]]
        self._least, self._unsolved = env.record.min_distance, 0

    def decide(self, planner: Planner, observation: dict[str, np.ndarray]) -> FloatArray:
        """The planner's action, timed."""
        begin = time.perf_counter()
        action = planner.act(observation)
        self._decision_time = time.perf_counter() - begin
        return action

    def look(self) -> None:
        """Take what the step that has just been done left in the environment's record."""
        record = self._env.record
        self._times.append(self._decision_time + record.layer_time)
        self._positions.append(record.state.T_world_ee[:3, 3])
        self._least = min(self._least, record.min_distance)
        qp = record.command.qp if record.command else None
        self._unsolved += qp is not None and qp.status == "braking"

    def read(self) -> Measurements:
        """All measurements, at the end of an episode of at least one step."""
        positions = np.array(self._positions)
        jerk = np.diff(positions, 3, axis=0) / STEP**3
        p50, p99 = np.percentile(self._times, [50, 99])
        moved = np.linalg.norm(positions[-_STUCK_STEPS - 1 :] - positions[-1], axis=1).max()
        return Measurements(
            planning_time=sum(self._times),
            planning_p50=_MILLISECONDS * float(p50),
            planning_p99=_MILLISECONDS * float(p99),
            jerk_ee=float(np.sqrt((jerk**2).sum(axis=1).mean())) if len(jerk) else 0.0,
            min_distance=self._least,
            unsolved=self._unsolved,
            stands_still=len(self._times) >= _STUCK_STEPS and bool(moved < _STUCK_DISTANCE),
        )
