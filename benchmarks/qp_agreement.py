"""The QP's hot path against the paper's full form in other solvers, on ticks of real episodes.

One process, one thread, processor time; medians and ratios count, not the absolute times.

    python benchmarks/qp_agreement.py [--count 10000] [--out benchmarks/results/qp_agreement.json]
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import qpsolvers
from circumstances import circumstances, write_json
from control_states import episode_states
from processor_time import timed

from horf_env.control import PRESETS, ControlTick, QpSolution, WholeBodyQp
from horf_env.control.reduction import reduced_qp, solved
from horf_env.control.reference import solve_reference
from horf_env.control.sdf_qp_layer import SdfQpLayer
from horf_env.control.solvers import DaqpSolver, PiqpSolver
from horf_env.errors import SolverError
from horf_env.robot import LIMITS, MobileManipulator
from horf_env.sdf import RobotSdf
from horf_env.task import STEP

_AGREE = 1e-3  # m/s and rad/s
# PIQP as it comes stops within 1e-8 of the least cost, which is flat, and DAQP overlooks violations
# of 1e-6: how far they are off with less.
_TIGHT = {
    "piqp": {"eps_duality_gap_abs": 1e-12, "eps_duality_gap_rel": 1e-12},
    "daqp": {"primal_tol": 1e-11},
}


class Tally:
    """Differences and times over all ticks."""

    def __init__(self) -> None:
        self.times: dict[str, list[float]] = {}
        self.errors: dict[str, list[float]] = {}
        self.failures: dict[str, int] = {}
        self.statuses: dict[str, int] = {}
        self.conflicts = 0

    def hot_path(self, qp: WholeBodyQp, tick: ControlTick) -> QpSolution:
        """Solve as the environment does."""
        solution, microseconds = timed(qp.solve, tick)
        self.times.setdefault("rows + solve", []).append(microseconds)
        self.statuses[solution.status] = self.statuses.get(solution.status, 0) + 1
        self.conflicts += bool(solution.violated_rows)
        parts = qp._parts(tick)
        self.times.setdefault("solve", []).append(timed(lambda: solved(*parts))[1])
        reduced = reduced_qp(*parts)
        for solver in (DaqpSolver(), PiqpSolver()):
            name = f"{type(solver).__name__}, 10 variables"
            self.times.setdefault(name, []).append(timed(solver.solve, reduced)[1])
        return solution

    def reference(
        self, problem: qpsolvers.Problem, solution: QpSolution, solver: str, **settings: float
    ) -> None:
        """Solve the full form by another solver and compare."""
        name = ", ".join([solver, *(f"{key} {value:g}" for key, value in settings.items())])
        try:
            x, microseconds = timed(solve_reference, problem, solver, **settings)
        except SolverError:
            self.failures[name] = self.failures.get(name, 0) + 1
            return
        self.times.setdefault(f"{name}, through qpsolvers, 16 variables", []).append(microseconds)
        self.errors.setdefault(name, []).append(np.abs(x[:9] - solution.velocity).max())

    def summary(self) -> dict[str, Any]:
        """What goes into the JSON."""
        return {
            "statuses": self.statuses,
            "ticks_with_conflicting_rows": self.conflicts,
            "reference_failures": self.failures,
            "median_us": {name: float(np.median(t)) for name, t in self.times.items()},
            "difference": {
                solver: {
                    "max": float(np.max(e)),
                    "p99": float(np.percentile(e, 99)),
                    f"share_above_{_AGREE}": float(np.mean(np.array(e) > _AGREE)),
                }
                for solver, e in self.errors.items()
            },
        }


def measure(count: int, seed: int, solvers: list[str]) -> dict[str, Any]:
    """All ticks through all solvers."""
    sdf = RobotSdf.load(MobileManipulator.load())
    layer = SdfQpLayer(sdf, LIMITS["ld60"], PRESETS["default"], STEP)
    qp, tally = PRESETS["default"].whole_body_qp(), Tally()
    for action, sensed in episode_states(count, seed):
        tick = layer.tick(action * LIMITS["ld60"].twist_scale, sensed)
        solution = tally.hot_path(qp, tick)
        problem = qp.problem(tick)
        for solver in solvers:
            tally.reference(problem, solution, solver)
            if solver in _TIGHT:
                tally.reference(problem, solution, solver, **_TIGHT[solver])
    return tally.summary()


def main() -> None:
    """Measure and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--solvers", nargs="+", default=list(qpsolvers.available_solvers))
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/qp_agreement.json"))
    arguments = parser.parse_args()
    result = {
        **circumstances(),
        "threads": os.environ.get("OMP_NUM_THREADS", "all"),
        "count": arguments.count,
        "seed": arguments.seed,
        **measure(arguments.count, arguments.seed, arguments.solvers),
    }
    write_json(result, arguments.out)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
