"""The whole-body QP: both forms agree, limits hold, a solution always exists."""

from dataclasses import replace

import numpy as np
import pytest
import qpsolvers

from horf_env.control import PRESETS, control_preset
from horf_env.control.qp import ACTIVE, WholeBodyQp
from horf_env.control.reference import solve_reference
from horf_env.control.solvers import Answer, DaqpSolver, PiqpSolver
from horf_env.errors import SolverError, UnknownNameError
from horf_env.robot import ARM_READY

QR = np.concatenate([np.zeros(3), ARM_READY])
NO_POINTS = np.zeros((0, 3))


class Broken:
    """A solver that never has an answer."""

    def solve(self, qp):
        return Answer(None, 0)


def give_up(monkeypatch):
    """Our own solver finds nothing any more."""
    monkeypatch.setattr("horf_env.control.qp.solved", lambda *_: (np.full(16, np.nan), 0, False))


@pytest.mark.parametrize("preset", PRESETS)
def test_hot_path_equals_the_paper_form_through_qpsolvers(preset, random_ticks):
    qp = control_preset("default").whole_body_qp()
    # The ticks have the witness points of the default preset.
    qp = WholeBodyQp(PRESETS[preset].objective, qp._limits, qp._rows)
    for tick in random_ticks(40):
        solution = qp.solve(tick)
        x = solve_reference(qp.problem(tick), "daqp", primal_tol=1e-11)
        np.testing.assert_allclose(solution.velocity, x[:9], atol=1e-6)
        np.testing.assert_allclose(solution.slack, x[9:15], atol=1e-6)
        assert solution.row_slack == pytest.approx(x[15], abs=1e-6)


@pytest.mark.parametrize("solver", qpsolvers.available_solvers)
def test_every_installed_solver_agrees(solver, random_ticks):
    qp = control_preset("default").whole_body_qp()
    for tick in random_ticks(10, seed=7):
        x = solve_reference(qp.problem(tick), solver)
        np.testing.assert_allclose(qp.solve(tick).velocity, x[:9], atol=1e-3)


def test_limits_and_rows_hold_in_every_answer(random_ticks):
    qp = control_preset("default").whole_body_qp()
    for tick in random_ticks(60, seed=1):
        solution = qp.solve(tick)
        limits = tick.limits
        assert solution.status == "solved"
        assert (np.abs(solution.velocity) <= limits.velocity + 1e-6).all()
        change = np.abs(solution.velocity - tick.velocity)
        assert (change <= limits.acceleration * tick.dt + 1e-6).all()
        problem = qp.problem(tick)
        violation = problem.G[:, :9] @ solution.velocity - problem.h
        assert violation.max() <= solution.row_slack + 1e-3


def test_a_free_robot_follows_the_twist(make_tick):
    qp = control_preset("default").whole_body_qp()
    twist = np.array([0.2, 0.1, -0.05, 0.0, 0.1, 0.2])
    velocity = np.zeros(9)
    for _ in range(20):  # give the acceleration limits time
        tick = make_tick(QR, NO_POINTS, twist, velocity=velocity)
        velocity = qp.solve(tick).velocity
    np.testing.assert_allclose(tick.state.ee_jacobian @ velocity, twist, atol=0.02)
    solution = qp.solve(tick)
    np.testing.assert_allclose(solution.slack, twist - tick.state.ee_jacobian @ solution.velocity)


def test_a_row_that_stops_the_robot_is_named(make_tick):
    qp = control_preset("default").whole_body_qp()
    wall = np.array([[0.43, y, z] for y in np.linspace(-0.3, 0.3, 7) for z in (0.1, 0.3)])
    solution = qp.solve(make_tick(QR, wall, np.array([1.0, 0, 0, 0, 0, 0])))
    assert any(name.startswith("obstacle base_link") for name in solution.active_rows)
    assert solution.velocity[0] < 0.06


def test_conflicting_obstacles_still_have_an_answer(make_tick):
    qp = control_preset("default").whole_body_qp()
    squeezed = np.array([[x, y, 0.2] for x in np.linspace(-0.3, 0.3, 7) for y in (-0.26, 0.26)])
    solution = qp.solve(make_tick(QR, squeezed, np.ones(6)))
    assert solution.status == "solved"
    assert np.isfinite(solution.velocity).all()
    assert solution.row_slack > 0.01
    violated = {name.rsplit(" ", 1)[0] for name in solution.violated_rows}
    assert "obstacle base_link" in violated
    assert set(solution.violated_rows) <= set(solution.active_rows)


def test_the_names_are_those_of_all_rows_near_their_bounds(random_ticks):
    qp = control_preset("default").whole_body_qp()
    for tick in random_ticks(40, seed=3):
        solution, problem = qp.solve(tick), qp.problem(tick)
        room = problem.h - problem.G[:, :9] @ solution.velocity
        names = solution.row_names
        np.testing.assert_allclose(solution.room, room, atol=1e-12)
        assert solution.active_rows == tuple(names[i] for i in np.flatnonzero(room < ACTIVE))
        assert solution.violated_rows == tuple(names[i] for i in np.flatnonzero(room < -ACTIVE))


def test_a_problem_without_any_row_has_an_answer(make_tick, monkeypatch):
    qp = control_preset("paper").whole_body_qp()
    qp = WholeBodyQp(qp._objective, qp._limits, [])
    tick = make_tick(QR, NO_POINTS, np.array([0.2, 0.0, 0.0, 0.0, 0.0, 0.0]))
    solution = qp.solve(tick)
    assert (solution.status, len(solution.rows), solution.active_rows) == ("solved", 0, ())
    for solver in (DaqpSolver(), PiqpSolver()):
        give_up(monkeypatch)
        qp._fallbacks = (solver,)
        fallback = qp.solve(tick)
        assert fallback.status == "fallback"
        np.testing.assert_allclose(fallback.velocity, solution.velocity, atol=2e-3)


def test_fallback_and_braking(random_ticks, monkeypatch):
    qp = control_preset("default").whole_body_qp()
    (tick,) = random_ticks(1, seed=5)
    expected = qp.solve(tick)
    give_up(monkeypatch)
    for fallbacks in (qp._fallbacks, (Broken(), PiqpSolver())):
        qp._fallbacks = fallbacks
        fallback = qp.solve(tick)
        assert fallback.status == "fallback"
        np.testing.assert_allclose(fallback.velocity, expected.velocity, atol=2e-3)
        np.testing.assert_allclose(fallback.slack, expected.slack, atol=2e-3)
    qp._fallbacks = (Broken(), Broken())
    braking = qp.solve(tick)
    assert braking.status == "braking"
    assert (np.abs(braking.velocity) <= np.abs(tick.velocity)).all()
    change = np.abs(braking.velocity - tick.velocity)
    assert (change <= tick.limits.acceleration * tick.dt + 1e-12).all()
    left = tick.twist - tick.state.ee_jacobian @ braking.velocity
    np.testing.assert_allclose(braking.slack, left)


def test_a_fast_base_does_not_turn_sharply(make_tick):
    qp = control_preset("default").whole_body_qp()
    velocity = np.array([1.5, 0.3, *np.zeros(7)])
    turn_left = np.array([1.5, 1.5, 0.0, 0.0, 0.0, 1.2])
    tick = make_tick(QR, NO_POINTS, turn_left, velocity=velocity, position_error=4.0)
    assert qp.solve(tick).velocity[1] == pytest.approx(tick.limits.lateral_acceleration / 1.5)


def test_settings_of_ones_own_pass_through():
    preset = replace(PRESETS["default"], gain=1.0)
    assert control_preset(preset) is preset


def test_reference_path_names_what_is_wrong(random_ticks):
    (tick,) = random_ticks(1)
    problem = control_preset("default").whole_body_qp().problem(tick)
    with pytest.raises(UnknownNameError, match="unknown QP solver 'piqqp'"):
        solve_reference(problem, "piqqp")
    with pytest.raises(UnknownNameError, match="did you mean 'eps_abs'"):
        solve_reference(problem, "piqp", eps_ab=1e-9)
    with pytest.raises(UnknownNameError, match="did you mean 'iter_limit'"):
        solve_reference(problem, "daqp", iter_limits=3)
    with pytest.raises(SolverError, match="daqp"):
        solve_reference(problem, "daqp", iter_limit=1)


def test_unknown_preset():
    with pytest.raises(UnknownNameError, match="did you mean 'paper'"):
        control_preset("papper")
