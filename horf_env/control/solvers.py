"""Solvers of the reduced QP: PIQP, and DAQP where it fails."""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np
import piqp

from horf_env.types import FloatArray


@dataclass(frozen=True)
class ReducedQp:
    """min 1/2 x^T P x + c^T x subject to lower <= (x, G x) <= upper.

    The bounds of the unknowns come first and those of the rows behind them, as DAQP takes them.

    Attributes:
        P: Shape (n, n), positive definite.
        c: Shape (n,).
        G: Shape (m, n).
        lower: Shape (n + m,); -inf for the rows.
        upper: Shape (n + m,).
    """

    P: FloatArray
    c: FloatArray
    G: FloatArray
    lower: FloatArray
    upper: FloatArray

    @property
    def h(self) -> FloatArray:
        """Right-hand sides of the rows, shape (m,), a view."""
        return self.upper[len(self.c) :]


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
        solver, n = piqp.DenseSolver(), len(qp.c)
        P, G = np.asfortranarray(qp.P), np.asfortranarray(qp.G)
        solver.setup(P, qp.c, None, None, G, None, qp.h, qp.lower[:n], qp.upper[:n])
        solved = solver.solve() == piqp.PIQP_SOLVED
        return Answer(np.array(solver.result.x) if solved else None, int(solver.result.info.iter))


class DaqpSolver:
    """DAQP, an active-set solver: exact, and it fails on other problems than PIQP does."""

    def solve(self, qp: ReducedQp) -> Answer:
        """Solve from scratch: a start from the last answer would make this one depend on it."""
        x, _, flag, info = daqp.solve(qp.P, qp.c, qp.G, qp.upper, qp.lower)
        return Answer(np.array(x) if flag == 1 else None, int(info["iterations"]))
