"""Solver of the reduced QP: PIQP with reused memory, DAQP where it fails."""

from __future__ import annotations

from dataclasses import dataclass

import daqp
import numpy as np
import piqp

from horf_env.types import FloatArray


@dataclass(frozen=True)
class ReducedQp:
    """min 1/2 x^T P x + c^T x subject to G x <= h and lower <= x <= upper.

    Attributes:
        P: Shape (n, n), positive definite.
        c: Shape (n,).
        G: Shape (m, n).
        h: Shape (m,).
        lower: Shape (n,).
        upper: Shape (n,).
    """

    P: FloatArray
    c: FloatArray
    G: FloatArray
    h: FloatArray
    lower: FloatArray
    upper: FloatArray


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
    """PIQP behind fixed shapes, so that its memory is allocated once."""

    def __init__(self) -> None:
        self._solver: piqp.DenseSolver | None = None

    def solve(self, qp: ReducedQp) -> Answer:
        """Solve; PIQP wants column-major matrices."""
        P, G = np.asfortranarray(qp.P), np.asfortranarray(qp.G)
        if self._solver is None:
            self._solver = piqp.DenseSolver()
            self._solver.setup(P, qp.c, None, None, G, None, qp.h, qp.lower, qp.upper)
        else:
            self._solver.update(P=P, c=qp.c, G=G, h_u=qp.h, x_l=qp.lower, x_u=qp.upper)
        solved = self._solver.solve() == piqp.PIQP_SOLVED
        x = np.array(self._solver.result.x) if solved else None
        return Answer(x, int(self._solver.result.info.iter))


class DaqpSolver:
    """DAQP, an active-set solver: exact, and it fails on other problems than PIQP does."""

    def solve(self, qp: ReducedQp) -> Answer:
        """Solve; DAQP takes the bounds as the first of its two-sided constraints."""
        upper = np.concatenate([qp.upper, qp.h])
        lower = np.concatenate([qp.lower, np.full(len(qp.h), -np.inf)])
        x, _, flag, info = daqp.solve(qp.P, qp.c, qp.G, upper, lower)
        return Answer(np.array(x) if flag == 1 else None, int(info["iterations"]))
