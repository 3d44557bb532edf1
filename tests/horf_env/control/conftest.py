"""Control ticks of random states among random points."""

import numpy as np
import pytest

from horf_env.control import ControlTick
from horf_env.robot import ARM_READY, LIMITS, integrate

DT = 0.05


@pytest.fixture(scope="session")
def make_tick(robot, sdf):
    def make(
        q,
        points,
        twist,
        *,
        velocity=None,
        limits="ld60",
        count=8,
        position_error=1.0,
        posture=ARM_READY,
    ):
        state = robot.state(q)
        velocity = np.zeros(9) if velocity is None else velocity
        profile = LIMITS[limits]
        return ControlTick(
            state=state,
            velocity=velocity,
            twist=twist,
            position_error=position_error,
            posture=posture,
            obstacles=sdf.witnesses(
                points,
                state,
                count=count,
                spacing=0.12,
                cutoff=2.0,
                velocity=velocity,
                braking=profile.braking,
            ),
            floor=sdf.floor_witnesses(state),
            own_base=sdf.own_base_witnesses(state, count=4, spacing=0.05, cutoff=0.5),
            unseen=np.empty((0, 2)),
            limits=profile,
            dt=DT,
        )

    return make


@pytest.fixture(scope="session")
def random_ticks(make_tick):
    """Ticks along short random drives: states, velocities and clearances that belong together."""

    def ticks(n, seed=0):
        rng = np.random.default_rng(seed)
        limits = LIMITS["ld60"]
        for _ in range(n):
            middle = 0.5 * (limits.arm_lower + limits.arm_upper)
            spread = 0.5 * (limits.arm_upper - limits.arm_lower)
            arm = middle + 0.8 * spread * rng.uniform(-1, 1, 7)
            q = np.concatenate([rng.uniform(-1, 1, 3), arm])
            velocity = 0.5 * limits.velocity * rng.uniform(-1, 1, 9)
            points = rng.uniform([-2.5, -2.5, 0.05], [2.5, 2.5, 1.5], (300, 3))
            twist = limits.twist_scale * rng.uniform(-1, 1, 6)
            yield make_tick(integrate(q, velocity, DT), points, twist, velocity=velocity)

    return ticks


@pytest.fixture(scope="session")
def filled():
    """G and h of rows at a tick, written into memory that held something else."""

    def fill(rows, tick):
        table = np.full((len(rows.names()), 10), np.nan)
        rows.fill(tick, table)
        return table[:, :9], table[:, 9]

    return fill
