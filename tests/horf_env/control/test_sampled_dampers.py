"""Sampled points: where they are, what their rows say."""

import numpy as np
import pytest

from horf_env.control.sampled_dampers import SampledDampers
from horf_env.robot import ARM_READY, integrate
from horf_env.sdf.body_samples import BodySamples

QR = np.concatenate([[0.3, -0.2, 0.7], ARM_READY])
STEP = 1e-6  # s


@pytest.fixture(scope="module")
def samples(robot):
    return BodySamples.load(robot)


@pytest.fixture(scope="module")
def dampers(robot, samples):
    return SampledDampers(
        lambda tick: samples.witnesses(tick.points, tick.state),
        bodies=robot.link_names,
        count=samples.count,
        gain=1.0,
        influence=0.3,
        stopping=0.05,
    )


class Tick:
    def __init__(self, points, state):
        self.points, self.state = points, state


def cloud(n=400):
    return np.random.default_rng(3).uniform([-1, -1, 0], [1.6, 1, 1.5], (n, 3))


def test_forty_samples_lie_on_the_surface(robot, sdf, samples):
    assert samples._used.sum() == 40
    assert samples._used.any(axis=1).all()
    for body in range(9):
        points = samples._local[body][samples._used[body]]
        np.testing.assert_allclose(sdf.link_distance(body, points), 0.0, atol=1e-6)


def test_samples_never_see_less_distance_than_there_is(robot, sdf, samples):
    points = cloud()
    state = robot.state(QR)
    found = samples.witnesses(points, state)
    true = sdf.query(points, QR).distance
    outside = true > 0.0
    assert (found.distance[outside, 0] >= true[outside] - 1e-9).all()
    assert (found.distance[:, 1:] >= found.distance[:, :-1]).all()


def test_rows_equal_the_change_of_the_sampled_distances(robot, samples, dampers, filled):
    points = cloud()
    rng = np.random.default_rng(0)
    before = samples.witnesses(points, robot.state(QR))
    G, h = filled(dampers, Tick(points, robot.state(QR)))
    near = (before.distance < 0.3).ravel()
    assert near.sum() > 10
    for _ in range(5):
        velocity = rng.uniform(-1, 1, 9)
        after = robot.state(integrate(QR, velocity, STEP))
        # The same obstacle points from the same samples, a moment later.
        R, t = after.link_poses[:, :3, :3], after.link_poses[:, None, :3, 3]
        moved = samples._local @ R.transpose(0, 2, 1) + t
        distances = np.linalg.norm(before.point[:, :, None] - moved[:, None], axis=3)
        change = (distances - before.distance[:, :, None]) / STEP
        row = (G @ velocity)[near]
        match = np.abs(change.reshape(len(G), -1)[near] + row[:, None]).min(axis=1)
        np.testing.assert_allclose(match, 0.0, atol=1e-4)
    distance = before.distance.ravel()[near]
    np.testing.assert_allclose(h[near], (distance - 0.05) / 0.25)
    assert (h[~near] == 1.0).all()
    assert (G[~near] == 0.0).all()


def test_no_points_no_rows(robot, dampers, filled):
    G, h = filled(dampers, Tick(np.zeros((0, 3)), robot.state(QR)))
    assert (G == 0.0).all()
    assert (h == 1.0).all()
