import time
from types import SimpleNamespace

import numpy as np
import pytest
from horf_cli.meter import Meter


class Env:
    """Stands for the environment: a record with the end effector on a given path."""

    def __init__(self, positions, statuses=("solved",)):
        self.positions, self.statuses, self.step = positions, statuses, 0

    @property
    def record(self):
        pose = np.eye(4)
        pose[:3, 3] = self.positions[self.step]
        qp = SimpleNamespace(status=self.statuses[self.step % len(self.statuses)])
        return SimpleNamespace(
            state=SimpleNamespace(T_world_ee=pose),
            min_distance=0.5 - 0.01 * self.step,
            layer_time=0.003,
            command=SimpleNamespace(qp=qp) if self.step else None,
        )


class Planner:
    def act(self, observation):
        time.sleep(0.002)
        return observation


def measure(positions, **options):
    env = Env(np.asarray(positions), **options)
    meter = Meter(env)
    for env.step in range(1, len(positions)):
        meter.decide(Planner(), np.zeros(6))
        meter.look()
    return meter.read()


def line(x):
    return np.column_stack([x, 0 * x, 0 * x])


def test_jerk_of_a_cubic_is_its_third_derivative():
    t = 0.05 * np.arange(30)
    assert measure(line(2.0 * t**3)).jerk_ee == pytest.approx(12.0)
    assert measure(line(5.0 * t**2)).jerk_ee == pytest.approx(0.0, abs=1e-6)
    assert measure(line(t[:3])).jerk_ee == 0.0


def test_planning_is_decision_and_layer():
    found = measure(line(np.arange(11.0)))
    assert found.planning_p50 >= 5.0
    assert found.planning_p99 >= found.planning_p50
    assert found.planning_time == pytest.approx(10 * found.planning_p50 / 1e3, rel=0.5)
    assert found.min_distance == pytest.approx(0.4)


def test_braking_ticks_are_counted():
    found = measure(line(np.arange(10.0)), statuses=("braking", "solved", "fallback"))
    assert found.unsolved == 3  # ticks 3, 6 and 9


@pytest.mark.parametrize(
    ("last_move", "steps", "stands"), [(0.04, 120, True), (0.06, 120, False), (0.0, 99, False)]
)
def test_stands_still_if_it_moved_less_than_5_cm_in_5_s(monkeypatch, last_move, steps, stands):
    monkeypatch.setattr(time, "sleep", lambda _: None)
    x = np.concatenate([np.linspace(0.0, 3.0, max(steps - 101, 0)), np.full(100, 3.0)])[: steps + 1]
    x = np.concatenate([x, x[-1:] + last_move])[-steps - 1 :]
    assert measure(line(x)).stands_still is stands
