"""The whole-body QP: an EE twist in, joint velocities out, without hitting anything."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import qpsolvers

from horf_env.control.avoidance import Rows
from horf_env.control.bounds import Bounds, combined_bounds, stacked_bounds
from horf_env.control.objective import Objective
from horf_env.control.reduction import ACTIVE, MOST_ROW_SLACK, ROW_SLACK_COST, outcome, reduced
from horf_env.control.solvers import DaqpSolver, PiqpSolver, ReducedQp
from horf_env.control.tick import ControlTick
from horf_env.types import FloatArray, IntArray

Status = Literal["solved", "fallback", "braking"]


@dataclass(frozen=True)
class QpSolution:
    """What the QP decided, and how.

    Attributes:
        velocity: Shape (9,), m/s and rad/s; always finite and within the acceleration limits.
        slack: Part of the twist that is not followed (delta of the paper), shape (6,).
        row_slack: Violation shared by all avoidance rows [m/s]; 0 if all hold.
        status: "solved" by DAQP, "fallback" by PIQP, or "braking" because neither could.
        iterations: Iterations of the solver that answered.
        room: What the avoidance rows that say anything at this tick have left [m/s]; negative where
            they are not kept.
        rows: Places of these rows in `row_names`.
        row_names: Names of all avoidance rows.
        solve_time: Time to build and solve [s].
    """

    velocity: FloatArray
    slack: FloatArray
    row_slack: float
    status: Status
    iterations: int
    room: FloatArray
    rows: IntArray
    row_names: tuple[str, ...]
    solve_time: float

    @property
    def active_rows(self) -> tuple[str, ...]:
        """Names of the avoidance rows that hold the robot back."""
        return self._named(self.room < ACTIVE)

    @property
    def violated_rows(self) -> tuple[str, ...]:
        """Names of those that are not kept, because rows or limits are in conflict."""
        return self._named(self.room < -ACTIVE)

    def _named(self, mask: np.ndarray) -> tuple[str, ...]:
        return tuple(self.row_names[i] for i in self.rows[mask])


class WholeBodyQp:
    """The paper's QP over (velocity, EE slack), plus one slack that the avoidance rows share.

    The EE slack delta = twist - J velocity is eliminated for speed, which is exact since it has no
    bounds here (Haviland bounds it by 10, never reached). `problem` gives the paper's full form.
    """

    def __init__(
        self, objective: Objective, limits: Sequence[Bounds], rows: Sequence[Rows]
    ) -> None:
        """Compose the QP.

        Args:
            objective: Weights.
            limits: Boxes around the velocity, the most binding first.
            rows: Avoidance rows.
        """
        self._objective, self._limits, self._rows = objective, tuple(limits), tuple(rows)
        self._names = tuple(name for row in self._rows for name in row.names())
        self._solver, self._fallback = DaqpSolver(), PiqpSolver()

    def solve(self, tick: ControlTick) -> QpSolution:
        """Find the velocity of this tick; always answers, never raises for a hard problem."""
        begin = time.perf_counter()
        qp, rows = self._reduced(tick)
        status: Status = "solved"
        answer = self._solver.solve(qp)
        if answer.x is None:
            status, answer = "fallback", self._fallback.solve(qp)
        if answer.x is None:
            status, velocity, row_slack = "braking", braking_velocity(tick), 0.0
        else:
            velocity = np.minimum(np.maximum(answer.x[:9], qp.lower[:9]), qp.upper[:9])
            row_slack = max(float(answer.x[9]), 0.0)
        slack, room = outcome(velocity, qp.G, qp.upper, tick.state.ee_jacobian, tick.twist)
        return QpSolution(
            velocity=velocity,
            slack=slack,
            row_slack=row_slack,
            status=status,
            iterations=answer.iterations,
            room=room,
            rows=rows,
            row_names=self._names,
            solve_time=time.perf_counter() - begin,
        )

    def problem(self, tick: ControlTick) -> qpsolvers.Problem:
        """The QP in the paper's form, for any solver of qpsolvers and for inspection.

        Returns:
            Problem in x = (velocity (9), EE slack (6), row slack (1)).
        """
        terms = self._objective.terms(tick)
        G, h = self._stacked_rows(tick)
        lower, upper = combined_bounds(self._limits, tick)
        slack_weights = np.full(6, terms.slack_weight)
        P = np.diag(np.concatenate([terms.weights, slack_weights, [ROW_SLACK_COST]]))
        q = np.concatenate([terms.linear, np.zeros(6), [ROW_SLACK_COST]])
        unbounded = np.full(6, np.inf)
        return qpsolvers.Problem(
            P,
            q,
            np.hstack([G, np.zeros((len(G), 6)), -np.ones((len(G), 1))]),
            h,
            np.hstack([tick.state.ee_jacobian, np.eye(6), np.zeros((6, 1))]),
            tick.twist,
            np.concatenate([lower, -unbounded, [0.0]]),
            np.concatenate([upper, unbounded, [MOST_ROW_SLACK]]),
        )

    def _reduced(self, tick: ControlTick) -> tuple[ReducedQp, IntArray]:
        """The problem in x = (velocity (9), row slack (1)), and which rows are part of it."""
        terms = self._objective.terms(tick)
        G, h = self._stacked_rows(tick)
        boxes = stacked_bounds(self._limits, tick)
        *parts, rows = reduced(
            G,
            h,
            boxes,
            tick.state.ee_jacobian,
            tick.twist,
            terms.weights,
            terms.linear,
            terms.slack_weight,
        )
        return ReducedQp(*parts), rows

    def _stacked_rows(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        parts = [row.rows(tick) for row in self._rows]
        return np.concatenate([G for G, _ in parts]), np.concatenate([h for _, h in parts])


def braking_velocity(tick: ControlTick) -> FloatArray:
    """The last velocity, brought towards rest as fast as the acceleration limits allow."""
    change = tick.limits.acceleration * tick.dt
    return np.asarray(tick.velocity - np.clip(tick.velocity, -change, change))
