"""Reference path of the QP: any solver that qpsolvers knows, by name."""

from __future__ import annotations

import inspect
from typing import Any

import daqp
import piqp
import qpsolvers

from horf_env.errors import SolverError, UnknownNameError
from horf_env.types import FloatArray


def solve_reference(
    problem: qpsolvers.Problem, solver: str = "daqp", **settings: Any
) -> FloatArray:
    """Solve a problem of `WholeBodyQp.problem` through qpsolvers.

    Args:
        problem: In x = (velocity (9), EE slack (6), row slack (1)).
        solver: Name of an installed solver.
        settings: Settings of that solver. qpsolvers passes names on that the solver does not have
            without a word, so they are checked here.

    Returns:
        The minimiser, shape (16,).

    Raises:
        UnknownNameError: If the solver is not installed or does not have such a setting.
        SolverError: If it finds no solution.
    """
    if solver not in qpsolvers.available_solvers:
        raise UnknownNameError("QP solver", solver, qpsolvers.available_solvers)
    known = solver_settings(solver)
    for name in settings:
        if name not in known:
            raise UnknownNameError(f"setting of {solver}", name, known)
    solution = qpsolvers.solve_problem(problem, solver=solver, **settings)
    if not solution.found or solution.x is None:
        raise SolverError(f"{solver}: found no solution; try another of the installed solvers")
    return solution.x


def solver_settings(solver: str) -> tuple[str, ...]:
    """Names of the settings that can be checked, hence given: those of the two solvers we use."""
    if solver == "piqp":
        return tuple(name for name in dir(piqp.DenseSolver().settings) if not name.startswith("_"))
    if solver == "daqp":
        arguments = inspect.signature(daqp.solve).parameters.values()
        return tuple(a.name for a in arguments if isinstance(a.default, int | float))
    return ()
