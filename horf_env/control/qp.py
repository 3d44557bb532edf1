"""The whole-body QP: an EE twist in, joint velocities out, without hitting anything."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
import qpsolvers

from horf_env.control.avoidance import Rows
from horf_env.control.bounds import Bounds, combined_bounds
from horf_env.control.objective import Objective
from horf_env.control.reduction import (
    MOST_ROW_SLACK,
    ROW_SLACK_COST,
    Parts,
    expanded,
    reduced_qp,
    solved,
)
from horf_env.control.solvers import DaqpSolver, PiqpSolver, ReducedQp
from horf_env.control.tick import ControlTick
from horf_env.types import FloatArray

Status = Literal["solved", "fallback", "braking"]
ACTIVE = 1e-3  # m/s; a row this close to its bound counts as active


class QpSolution(NamedTuple):
    """What the QP decided, and how.

    Attributes:
        velocity: Shape (9,), m/s and rad/s; always finite and within the acceleration limits.
        slack: Part of the twist that is not followed (delta of the paper), shape (6,).
        row_slack: Violation shared by all avoidance rows [m/s]; 0 if all hold.
        status: "solved" as usual, "fallback" by another solver, or "braking" because none could.
        iterations: Iterations of the solver that answered.
        rows: (G, h) of all avoidance rows, shape (m, 10).
        row_names: Their names.
        solve_time: Time to build and solve [s].
    """

    velocity: FloatArray
    slack: FloatArray
    row_slack: float
    status: Status
    iterations: int
    rows: FloatArray
    row_names: tuple[str, ...]
    solve_time: float

    @property
    def room(self) -> FloatArray:
        """What each row has left, negative where it is not kept, shape (m,), m/s."""
        return np.asarray(self.rows[:, 9] - self.rows[:, :9] @ self.velocity)

    @property
    def active_rows(self) -> tuple[str, ...]:
        """Names of the avoidance rows that hold the robot back."""
        return self._named(self.room < ACTIVE)

    @property
    def violated_rows(self) -> tuple[str, ...]:
        """Names of those that are not kept, because rows or limits are in conflict."""
        return self._named(self.room < -ACTIVE)

    def _named(self, mask: np.ndarray) -> tuple[str, ...]:
        return tuple(self.row_names[i] for i in np.flatnonzero(mask))


class WholeBodyQp:
    """The paper's QP over (velocity, EE slack), plus one slack that the avoidance rows share.

    `problem` gives this full form; `solve` has fewer unknowns.
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
        ends = np.cumsum([len(row.names()) for row in self._rows]).tolist()
        self._places = tuple(map(slice, [0, *ends], ends))
        self._fallbacks = (DaqpSolver(), PiqpSolver())

    def solve(self, tick: ControlTick) -> QpSolution:
        """Find the velocity of this tick; always answers, never raises for a hard problem."""
        begin = time.perf_counter()
        parts = self._parts(tick)
        x, iterations, found = solved(*parts)
        status: Status = "solved"
        if not found:
            x, iterations, status = self._otherwise(tick, reduced_qp(*parts))
        return QpSolution(
            velocity=x[:9],
            slack=x[9:15],
            row_slack=float(x[15]),
            status=status,
            iterations=iterations,
            rows=parts[0],
            row_names=self._names,
            solve_time=time.perf_counter() - begin,
        )

    def problem(self, tick: ControlTick) -> qpsolvers.Problem:
        """The QP in the paper's form, for any solver of qpsolvers and for inspection.

        Returns:
            Problem in x = (velocity (9), EE slack (6), row slack (1)).
        """
        terms = self._objective.terms(tick)
        rows = self._all_rows(tick)
        lower, upper = combined_bounds(self._limits, tick)
        slack_weights = np.full(6, terms.slack_weight)
        P = np.diag(np.concatenate([terms.weights, slack_weights, [ROW_SLACK_COST]]))
        q = np.concatenate([terms.linear, np.zeros(6), [ROW_SLACK_COST]])
        unbounded = np.full(6, np.inf)
        return qpsolvers.Problem(
            P,
            q,
            np.hstack([rows[:, :9], np.zeros((len(rows), 6)), -np.ones((len(rows), 1))]),
            rows[:, 9].copy(),
            np.hstack([tick.state.ee_jacobian, np.eye(6), np.zeros((6, 1))]),
            tick.twist,
            np.concatenate([lower, -unbounded, [0.0]]),
            np.concatenate([upper, unbounded, [MOST_ROW_SLACK]]),
        )

    def _parts(self, tick: ControlTick) -> Parts:
        terms = self._objective.terms(tick)
        rows, box = self._all_rows(tick), combined_bounds(self._limits, tick)
        return (rows, box, tick.state.ee_jacobian, tick.twist, *terms)

    def _all_rows(self, tick: ControlTick) -> FloatArray:
        """(G, h) of all avoidance rows, shape (m, 10)."""
        table = np.empty((len(self._names), 10))
        for rows, place in zip(self._rows, self._places, strict=True):
            rows.fill(tick, table[place])
        return table

    def _otherwise(self, tick: ControlTick, qp: ReducedQp) -> tuple[FloatArray, int, Status]:
        """An answer (16,) of slower solvers, or of the brakes; its iterations."""
        J = tick.state.ee_jacobian
        for solver in self._fallbacks:
            answer = solver.solve(qp)
            if answer.x is not None:
                x = expanded(answer.x, qp.lower, qp.upper, J, tick.twist)
                return x, answer.iterations, "fallback"
        velocity = braking_velocity(tick)
        return np.concatenate([velocity, tick.twist - J @ velocity, [0.0]]), 0, "braking"


def braking_velocity(tick: ControlTick) -> FloatArray:
    """The last velocity, brought towards rest as fast as the acceleration limits allow."""
    change = tick.limits.acceleration * tick.dt
    return np.asarray(tick.velocity - np.clip(tick.velocity, -change, change))
