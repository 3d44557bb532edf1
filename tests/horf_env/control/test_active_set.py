"""Our own solver against DAQP and PIQP: random, degenerate and impossible problems."""

from dataclasses import replace

import numpy as np
import pytest
import qpsolvers
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls

from horf_env.control.active_set import minimiser
from horf_env.control.solvers import Answer, DaqpSolver, PiqpSolver, ReducedQp

SEEDS = st.integers(0, 2**32 - 1)
many = settings(max_examples=150, deadline=None)


def ours(qp):
    x, steps, found = minimiser(qp.P, qp.c, qp.lower, qp.upper, qp.rows)
    return Answer(x if found else None, steps)


def known(qp):
    """The minimiser by DAQP through qpsolvers, which otherwise overlooks violations of 1e-6."""
    arguments = (qp.P, qp.c, qp.G, qp.h, None, None, qp.lower, qp.upper)
    return qpsolvers.solve_qp(*arguments, solver="daqp", primal_tol=1e-11)


def random_problem(rng, m, most_slack=1e3):
    """Like those of the robot: a slack that is dear, rows of which some are in conflict."""
    J = rng.normal(size=(6, 9))
    P, c = np.zeros((10, 10)), np.append(rng.normal(size=9), 1e3)
    P[:9, :9] = 10.0 * J.T @ J + np.diag(rng.uniform(0.003, 0.3, 9))
    P[9, 9] = 1e3
    lower = np.append(rng.uniform(-2, 0, 9), 0.0)
    upper = np.append(rng.uniform(0, 2, 9), most_slack)
    rows = np.hstack([rng.normal(size=(m, 9)), rng.uniform(-0.3, 1.0, (m, 1))])
    return ReducedQp(P, c, lower, upper, rows)


def assert_optimal(qp, x, tolerance=1e-8):
    """Feasible, and outward normals of constraints that x is at add up to the downward gradient."""
    A = np.vstack([np.eye(len(x)), -np.eye(len(x)), qp.G])
    b = np.concatenate([qp.upper, -qp.lower, qp.h])
    room = b - A @ x
    assert room.min() > -tolerance
    gradient = qp.P @ x + qp.c
    _, left = nnls(A[room < tolerance].T, -gradient, maxiter=1000)
    assert left < tolerance * (1.0 + np.abs(gradient).max())


@many
@given(seed=SEEDS, m=st.integers(0, 80))
def test_random_problems(seed, m):
    qp = random_problem(np.random.default_rng(seed), m)
    x = ours(qp).x
    assert_optimal(qp, x)
    np.testing.assert_allclose(x, known(qp), atol=1e-8)


@many
@given(seed=SEEDS)
def test_degenerate_problems(seed):
    """Duplicates, multiples, near duplicates and sums of rows, and bounds that leave nothing."""
    rng = np.random.default_rng(seed)
    qp = random_problem(rng, 30)
    rows = qp.rows
    near = rows + rng.normal(size=rows.shape) * 10.0 ** rng.uniform(-16, -6, (len(rows), 1))
    rows = np.vstack([rows, rows, near, rows[:10] + rows[10:20], np.zeros((5, 10))])
    upper = np.where(rng.random(10) < 0.3, qp.lower, qp.upper)
    upper[9] = 1e3
    qp = replace(qp, rows=np.ascontiguousarray(rng.permutation(rows)), upper=upper)
    assert_optimal(qp, ours(qp).x)


@many
@given(seed=SEEDS)
def test_without_slack_a_problem_is_solved_or_called_impossible(seed):
    rng = np.random.default_rng(seed)
    qp = random_problem(rng, 6, most_slack=0.0)
    x, expected = ours(qp).x, known(qp)
    assert (x is None) == (expected is None)
    if x is not None:
        assert_optimal(qp, x)
        np.testing.assert_allclose(x, expected, atol=1e-8)


@many
@given(seed=SEEDS, silent=st.floats(0.0, 1.0))
def test_rows_that_say_nothing_do_not_change_a_digit_of_the_answer(seed, silent):
    rng = np.random.default_rng(seed)
    qp = random_problem(rng, 60)
    speaks = rng.random(60) >= silent
    qp.rows[~speaks] = np.append(np.zeros(9), 1.0)
    few = replace(qp, rows=qp.rows[speaks])
    np.testing.assert_array_equal(ours(qp).x, ours(few).x)


def test_a_row_that_no_velocity_can_keep_is_up_to_the_slack():
    qp = random_problem(np.random.default_rng(0), 1)
    qp.rows[0] = np.append(np.zeros(9), -0.1)
    assert ours(qp).x[9] == pytest.approx(0.1)


def test_what_is_not_a_number_is_not_called_solved():
    qp = random_problem(np.random.default_rng(0), 5)
    qp.c[3] = np.nan
    assert ours(qp).x is None


def test_bounds_may_be_infinite():
    qp = random_problem(np.random.default_rng(1), 20)
    qp.rows[:, :4] = 0.0
    free = replace(qp, lower=np.append(np.full(9, -np.inf), 0.0), upper=np.full(10, np.inf))
    assert_optimal(free, ours(free).x)


def test_all_solvers_agree_and_report_impossible_problems():
    for seed in range(10):
        qp = random_problem(np.random.default_rng(seed), 40)
        for solver in (DaqpSolver(), PiqpSolver()):
            np.testing.assert_allclose(solver.solve(qp).x, ours(qp).x, atol=2e-3)
    impossible = replace(qp, rows=np.full((40, 10), -0.0))
    impossible.rows[:, 9] = -1.0 - 1e3
    for solve in (DaqpSolver().solve, PiqpSolver().solve, ours):
        assert solve(impossible).x is None
