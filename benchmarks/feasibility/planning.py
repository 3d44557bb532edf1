"""RRT-Connect in a box of real numbers, by OMPL, with a budget counted in motions.

Counted, not timed: the result is the same on a slow and on a busy machine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from horf_env.types import FloatArray


@dataclass(frozen=True)
class Space:
    """Where to plan, and what is free there.

    Attributes:
        lower: Lower bounds, shape (D,).
        upper: Upper bounds, shape (D,).
        is_free: Whether a point (D,) is free.
        connects: Whether the straight motion between two points is free, both of them included.
        budget: Motions after whose check the search gives up.
        shortcuts: Rounds of shortening after a path is found.
    """

    lower: FloatArray
    upper: FloatArray
    is_free: Callable[[FloatArray], bool]
    connects: Callable[[FloatArray, FloatArray], bool]
    budget: int
    shortcuts: int


def rrt_connect(space: Space, start: FloatArray, goal: FloatArray, seed: int) -> FloatArray | None:
    """Corner points (N, D) of a free path from start to goal, or None within the budget."""
    ou.noOutputHandler()  # seeding again, which works, makes OMPL complain each time
    ou.RNG.setSeed(seed)
    setup, motions = _setup(space)
    setup.setStartAndGoalStates(_state(setup, start), _state(setup, goal))
    setup.solve(ob.PlannerTerminationCondition(lambda: motions.checked > space.budget))
    if not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    _shorten(setup, path, space.shortcuts)
    return np.array([_point(state, len(start)) for state in path.getStates()])


class _Motions(ob.MotionValidator):  # type: ignore[misc]  # ompl has no types
    """Passes OMPL's questions about motions on to the space, and counts them."""

    def __init__(self, information: ob.SpaceInformation, space: Space) -> None:
        super().__init__(information)
        self._space = space
        self.checked = 0

    def checkMotion(self, start: ob.State, end: ob.State) -> bool:  # noqa: N802
        """OMPL's name for the question."""
        self.checked += 1
        dimensions = len(self._space.lower)
        return self._space.connects(_point(start, dimensions), _point(end, dimensions))


def length(path: FloatArray) -> float:
    """Length of a polyline (N, D)."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def densify(path: FloatArray, step: float) -> FloatArray:
    """The polyline with corner points at most `step` apart."""
    pieces = [path[:1]]
    for a, b in pairwise(path):
        count = max(int(np.ceil(np.linalg.norm(b - a) / step)), 1)
        pieces.append(a + (b - a) * np.linspace(0.0, 1.0, count + 1)[1:, None])
    return np.vstack(pieces)


def _setup(space: Space) -> tuple[og.SimpleSetup, _Motions]:
    dimensions = len(space.lower)
    vector_space = ob.RealVectorStateSpace(dimensions)
    bounds = ob.RealVectorBounds(dimensions)
    for k in range(dimensions):
        bounds.setLow(k, float(space.lower[k]))
        bounds.setHigh(k, float(space.upper[k]))
    vector_space.setBounds(bounds)
    setup = og.SimpleSetup(vector_space)
    setup.setStateValidityChecker(lambda state: space.is_free(_point(state, dimensions)))
    information = setup.getSpaceInformation()
    motions = _Motions(information, space)
    information.setMotionValidator(motions)
    setup.setPlanner(og.RRTConnect(information))
    return setup, motions


def _point(state: ob.State, dimensions: int) -> FloatArray:
    return np.array([state[k] for k in range(dimensions)])


def _state(setup: og.SimpleSetup, point: FloatArray) -> ob.State:
    state = setup.getStateSpace().allocState()
    for k, value in enumerate(point):
        state[k] = float(value)
    return state


def _shorten(setup: og.SimpleSetup, path: og.PathGeometric, rounds: int) -> None:
    simplifier = og.PathSimplifier(setup.getSpaceInformation())
    for _ in range(rounds):
        simplifier.reduceVertices(path)
        simplifier.partialShortcutPath(path)
        simplifier.collapseCloseVertices(path)
