"""The whole-body QP: an EE twist in, joint velocities out, without hitting anything."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numba
import numpy as np
import qpsolvers

from horf_env.control.avoidance import Rows
from horf_env.control.bounds import Bounds, combined_bounds
from horf_env.control.objective import Objective
from horf_env.control.solvers import DaqpSolver, PiqpSolver, ReducedQp
from horf_env.control.tick import ControlTick
from horf_env.types import FloatArray

Status = Literal["solved", "fallback", "braking"]

# Cost of the shared slack of the avoidance rows, linear and quadratic. At 1e3 the slack is used
# only where no velocity keeps all rows (1 of 1980 problems otherwise; 68 with 10).
_ROW_SLACK_COST = 1e3
_MOST_ROW_SLACK = 1e3  # m/s; a bound that is never reached
_ACTIVE = 1e-3  # m/s; a row this close to its bound counts as active


@dataclass(frozen=True)
class QpSolution:
    """What the QP decided, and how.

    Attributes:
        velocity: Shape (9,), m/s and rad/s; always finite and within the acceleration limits.
        slack: Part of the twist that is not followed (delta of the paper), shape (6,).
        row_slack: Violation shared by all avoidance rows [m/s]; 0 if all hold.
        status: "solved" by DAQP, "fallback" by PIQP, or "braking" because neither could.
        iterations: Iterations of the solver that answered.
        active_rows: Names of the avoidance rows that hold the robot back.
        violated_rows: Names of those that are not kept, because rows or limits are in conflict.
        solve_time: Time to build and solve [s].
    """

    velocity: FloatArray
    slack: FloatArray
    row_slack: float
    status: Status
    iterations: int
    active_rows: tuple[str, ...]
    violated_rows: tuple[str, ...]
    solve_time: float


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
        qp = self._reduced(tick)
        status: Status = "solved"
        answer = self._solver.solve(qp)
        if answer.x is None:
            status, answer = "fallback", self._fallback.solve(qp)
        if answer.x is None:
            status, velocity, row_slack = "braking", braking_velocity(tick), 0.0
        else:
            velocity = np.minimum(np.maximum(answer.x[:9], qp.lower[:9]), qp.upper[:9])
            row_slack = max(float(answer.x[9]), 0.0)
        room = qp.h - qp.G[:, :9] @ velocity
        return QpSolution(
            velocity=velocity,
            slack=tick.twist - tick.state.ee_jacobian @ velocity,
            row_slack=row_slack,
            status=status,
            iterations=answer.iterations,
            active_rows=self._named(room < _ACTIVE),
            violated_rows=self._named(room < -_ACTIVE),
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
        P = np.diag(np.concatenate([terms.weights, slack_weights, [_ROW_SLACK_COST]]))
        q = np.concatenate([terms.linear, np.zeros(6), [_ROW_SLACK_COST]])
        unbounded = np.full(6, np.inf)
        return qpsolvers.Problem(
            P,
            q,
            np.hstack([G, np.zeros((len(G), 6)), -np.ones((len(G), 1))]),
            h,
            np.hstack([tick.state.ee_jacobian, np.eye(6), np.zeros((6, 1))]),
            tick.twist,
            np.concatenate([lower, -unbounded, [0.0]]),
            np.concatenate([upper, unbounded, [_MOST_ROW_SLACK]]),
        )

    def _reduced(self, tick: ControlTick) -> ReducedQp:
        """The problem in x = (velocity (9), row slack (1)), without the EE slack."""
        terms = self._objective.terms(tick)
        G, h = self._stacked_rows(tick)
        lower, upper = combined_bounds(self._limits, tick)
        P, c = _eliminated(
            tick.state.ee_jacobian, tick.twist, terms.weights, terms.linear, terms.slack_weight
        )
        G, lower, upper = _with_slack(G, lower, upper)
        return ReducedQp(P, c, G, h, lower, upper)

    def _named(self, rows: np.ndarray) -> tuple[str, ...]:
        return tuple(self._names[i] for i in rows.nonzero()[0])

    def _stacked_rows(self, tick: ControlTick) -> tuple[FloatArray, FloatArray]:
        parts = [row.rows(tick) for row in self._rows]
        return np.concatenate([G for G, _ in parts]), np.concatenate([h for _, h in parts])


@numba.njit(cache=True)
def _eliminated(
    J: FloatArray, twist: FloatArray, weights: FloatArray, linear: FloatArray, L: float
) -> tuple[FloatArray, FloatArray]:
    """Eliminate the EE slack: P = W + J^T L J, c = linear - J^T L twist, L = slack weight."""
    P, c = np.zeros((10, 10)), np.full(10, _ROW_SLACK_COST)
    for i in range(9):
        c[i] = linear[i]
        for k in range(6):
            c[i] -= L * J[k, i] * twist[k]
            for j in range(9):
                P[i, j] += L * J[k, i] * J[k, j]
        P[i, i] += weights[i]
    P[9, 9] = _ROW_SLACK_COST
    return P, c


@numba.njit(cache=True)
def _with_slack(
    G: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The rows and the box of the velocity, with the row slack as tenth unknown."""
    rows, low, high = np.full((len(G), 10), -1.0), np.zeros(10), np.full(10, _MOST_ROW_SLACK)
    rows[:, :9], low[:9], high[:9] = G, lower, upper
    return rows, low, high


def braking_velocity(tick: ControlTick) -> FloatArray:
    """The last velocity, brought towards rest as fast as the acceleration limits allow."""
    change = tick.limits.acceleration * tick.dt
    return np.asarray(tick.velocity - np.clip(tick.velocity, -change, change))
