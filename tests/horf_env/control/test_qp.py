"""The whole-body QP: both forms agree, limits hold, a solution always exists."""

import numpy as np
import pytest
import qpsolvers

from horf_env.control import PRESETS, control_preset
from horf_env.control.qp import WholeBodyQp
from horf_env.control.solvers import Answer, DaqpSolver, PiqpSolver
from horf_env.errors import UnknownNameError
from horf_env.robot import ARM_READY

QR = np.concatenate([np.zeros(3), ARM_READY])
NO_POINTS = np.zeros((0, 3))


class Broken:
    """A solver that never has an answer."""

    def solve(self, qp):
        return Answer(None, 0)


@pytest.mark.parametrize("preset", ["default", "paper"])
def test_hot_path_equals_the_paper_form_through_qpsolvers(preset, random_ticks):
    qp = control_preset("default").whole_body_qp()
    if preset == "paper":
        qp = WholeBodyQp(PRESETS["paper"].objective, qp._limits, qp._rows)
    for tick in random_ticks(40):
        solution = qp.solve(tick)
        reference = qpsolvers.solve_problem(qp.problem(tick), solver="daqp")
        assert reference.found
        np.testing.assert_allclose(solution.velocity, reference.x[:9], atol=2e-3)
        np.testing.assert_allclose(solution.slack, reference.x[9:15], atol=2e-3)
        assert solution.row_slack == pytest.approx(reference.x[15], abs=2e-3)


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


def test_fallback_and_braking(random_ticks):
    qp = control_preset("default").whole_body_qp()
    (tick,) = random_ticks(1, seed=5)
    expected = qp.solve(tick)
    qp._solver = Broken()
    fallback = qp.solve(tick)
    assert fallback.status == "fallback"
    np.testing.assert_allclose(fallback.velocity, expected.velocity, atol=2e-3)
    qp._fallback = Broken()
    braking = qp.solve(tick)
    assert braking.status == "braking"
    assert (np.abs(braking.velocity) <= np.abs(tick.velocity)).all()
    change = np.abs(braking.velocity - tick.velocity)
    assert (change <= tick.limits.acceleration * tick.dt + 1e-12).all()


def test_solvers_agree_and_report_infeasible_problems(random_ticks):
    qp = control_preset("default").whole_body_qp()
    piqp, daqp = PiqpSolver(), DaqpSolver()
    for tick in random_ticks(10, seed=7):
        reduced = qp._reduced(tick)
        np.testing.assert_allclose(piqp.solve(reduced).x, daqp.solve(reduced).x, atol=2e-3)
    # Rows that no slack can satisfy: the slack's own bounds are turned around.
    impossible = qp._reduced(tick)
    impossible.G[:] = 0.0
    impossible.h[:] = -1.0
    assert PiqpSolver().solve(impossible).x is None
    assert daqp.solve(impossible).x is None


def test_unknown_preset():
    with pytest.raises(UnknownNameError, match="did you mean 'paper'"):
        control_preset("papper")
