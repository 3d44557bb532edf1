"""In steady state a query makes no large arrays and keeps no memory."""

import tracemalloc

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from horf_env.robot import ARM_READY

QR = np.concatenate([np.zeros(3), ARM_READY])
OPTIONS = {"count": 8, "spacing": 0.05, "cutoff": 1.0, "braking": 0.5}
POINTS = 20_000
LARGE = 2 * POINTS  # bytes; half of what one float32 for each point takes


@pytest.fixture
def query(robot, sdf):
    rng = np.random.default_rng(0)
    points = rng.uniform([-2, -2, 0.05], [2, 2, 1.6], (POINTS, 3))
    state, velocity = robot.state(QR), 0.1 * np.ones(9)

    def query(n):
        sdf.witnesses(points[:n], state, velocity=velocity, **OPTIONS)
        sdf.query(points[:n], QR)

    for n in (100, POINTS):  # compile, and grow the work space
        query(n)
    return query


def test_no_array_of_the_size_of_the_cloud_is_made(query):
    tracemalloc.start()
    before, _ = tracemalloc.get_traced_memory()
    query(POINTS)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak - before < LARGE


def test_no_memory_is_kept(query):
    calls = 300
    tracemalloc.start()
    before, _ = tracemalloc.get_traced_memory()
    for _ in range(calls):
        query(1000)
    after, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert after - before < 200 * calls  # one answer takes 9 kB


@pytest.fixture
def counted():
    """Counts what compiled code allocates, which tracemalloc does not see."""
    _nrt_python.memsys_enable_stats()
    yield rtsys.get_allocation_stats
    _nrt_python.memsys_disable_stats()


def test_compiled_code_frees_what_it_takes_and_takes_no_more_for_more_points(query, counted):
    taken = []
    for n in (100, POINTS):
        before = counted()
        query(n)
        after = counted()
        assert after.alloc - before.alloc == after.free - before.free
        taken.append(after.alloc - before.alloc)
    assert 0 < taken[0] == taken[1]
