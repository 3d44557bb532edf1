"""Solvers of the reduced QP that are asked where our own gives up: DAQP, then PIQP."""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np
import piqp

from horf_env.types import FloatArray


@dataclass(frozen=True)
class ReducedQp:
    """What `minimiser` solves.

    Attributes:
        P: Positive definite, shape (n, n).
        c: Shape (n,).
        lower: Lower bounds, shape (n,).
        upper: Upper bounds, shape (n,).
        rows: (g, h) a row, shape (m, n).
    """

    P: FloatArray
    c: FloatArray
    lower: FloatArray
    upper: FloatArray
    rows: FloatArray

    @property
    def G(self) -> FloatArray:  # noqa: N802 a matrix
        """Rows with the coefficient of the slack, shape (m, n)."""
        return np.hstack([self.rows[:, :-1], -np.ones((len(self.rows), 1))])

    @property
    def h(self) -> FloatArray:
        """Right-hand sides of the rows, shape (m,)."""
        return self.rows[:, -1].copy()


@dataclass(frozen=True)
class Answer:
    """What a solver found.

    Attributes:
        x: Minimiser, shape (n,); None if the solver has none.
        iterations: Iterations it took.
    """

    x: FloatArray | None
    iterations: int


class PiqpSolver:
    """PIQP, an interior-point solver.

    Set up anew for each problem: reusing its memory saves 5 of some 60 us, but then an answer
    depends in its last digits on the problems before, and equal seeds give unequal episodes.
    """

    def solve(self, qp: ReducedQp) -> Answer:
        """Solve; PIQP wants column-major matrices."""
        solver = piqp.DenseSolver()
        P, G = np.asfortranarray(qp.P), np.asfortranarray(qp.G)
        solver.setup(P, qp.c, None, None, G, None, qp.h, qp.lower, qp.upper)
        solved = solver.solve() == piqp.PIQP_SOLVED
        return Answer(np.array(solver.result.x) if solved else None, int(solver.result.info.iter))


class DaqpSolver:
    """DAQP, an active-set solver: exact, and it fails on other problems than PIQP does."""

    def solve(self, qp: ReducedQp) -> Answer:
        """Solve from scratch: a start from the last answer would make this one depend on it."""
        h = qp.h
        lower = np.concatenate([qp.lower, np.full(len(h), -np.inf)])
        x, _, flag, info = daqp.solve(qp.P, qp.c, qp.G, np.concatenate([qp.upper, h]), lower)
        return Answer(np.array(x) if flag == 1 else None, int(info["iterations"]))
