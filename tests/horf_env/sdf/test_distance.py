"""Distances and gradients against libigl's brute force and central differences."""

import igl
import numpy as np
import pytest

from horf_env.errors import CloudError, QueryError, UnknownNameError
from horf_env.robot import ARM_READY, LIMITS, collision_parts, integrate, point_jacobian
from horf_env.sdf import RobotSdf

QR = np.concatenate([[0.4, -0.3, 0.7], ARM_READY])


def random_configuration(rng):
    limits = LIMITS["ld60"]
    return np.concatenate([rng.uniform(-1, 1, 3), rng.uniform(limits.arm_lower, limits.arm_upper)])


def clutter(rng, n=1500):
    return rng.uniform([-2, -2, 0.05], [2, 2, 1.6], (n, 3))


@pytest.mark.parametrize("body", range(9))
def test_hull_distance_equals_brute_force(sdf, body):
    rng = np.random.default_rng(body)
    parts = collision_parts()[body]
    corners = np.concatenate([part.vertices for part in parts])
    points = rng.uniform(corners.min(axis=0) - 0.3, corners.max(axis=0) + 0.3, (2000, 3))
    signed = []
    for part in parts:
        squared, _, _ = igl.point_mesh_squared_distance(points, part.vertices, part.faces)
        inside = igl.fast_winding_number(part.vertices, part.faces, points) > 0.5
        signed.append(np.where(inside, -1, 1) * np.sqrt(squared))
    np.testing.assert_allclose(sdf.link_distance(body, points), np.min(signed, axis=0), atol=1e-9)


def test_query_finds_the_nearest_point_of_each_body(robot, sdf):
    rng = np.random.default_rng(0)
    for scale in (0.3, 1.0, 5.0):  # dense around the robot, and far beyond the fields
        q, points = random_configuration(rng), clutter(rng) * scale
        found = sdf.query(points, q)
        for body, T in enumerate(robot.link_poses(q)):
            distances = sdf.link_distance(body, (points - T[:3, 3]) @ T[:3, :3])
            assert found.distance[body] == pytest.approx(distances.min(), abs=1e-12)
            assert distances[found.point_index[body]] == pytest.approx(distances.min(), abs=1e-12)


def test_gradient_matches_central_differences(sdf):
    rng = np.random.default_rng(1)
    step = 1e-6
    for _ in range(5):
        q, points = random_configuration(rng), clutter(rng, 300)
        found = sdf.query(points, q)
        for body in range(9):
            own = points[found.point_index[body]][None]  # one point: no switch within the step
            numeric = [
                (
                    sdf.query(own, integrate(q, e, step)).distance[body]
                    - sdf.query(own, integrate(q, -e, step)).distance[body]
                )
                / (2 * step)
                for e in np.eye(9)
            ]
            np.testing.assert_allclose(found.gradient[body], numeric, atol=1e-6)


def test_witnesses_keep_their_distance_and_begin_with_the_nearest(robot, sdf):
    rng = np.random.default_rng(2)
    points, state = clutter(rng, 4000), robot.state(QR)
    found = sdf.witnesses(points, state, count=8, spacing=0.12, cutoff=0.5)
    nearest = sdf.query(points, QR)
    np.testing.assert_array_equal(found.index[:, 0], nearest.point_index)
    for body in range(9):
        chosen = found.point[body][np.isfinite(found.distance[body])]
        assert len(chosen) == 8
        gaps = np.linalg.norm(chosen[:, None] - chosen[None], axis=2) + np.eye(len(chosen))
        assert gaps.min() >= 0.12
        assert np.nanmax(found.distance[body]) <= 0.5 + 0.2  # the box is within the hull's slack


def test_a_fast_approach_puts_the_point_ahead_before_a_nearer_one_aside(robot, sdf):
    q = np.concatenate([np.zeros(3), ARM_READY])
    aside = [np.array([x, 0.75, 0.2]) for x in np.linspace(-0.3, 0.3, 4)]
    ahead = np.array([1.6, 0.0, 0.2])
    points, state = np.array([*aside, ahead]), robot.state(q)
    options = {"count": 2, "spacing": 0.1, "cutoff": 3.0, "braking": 1.0}
    at_rest = sdf.witnesses(points, state, **options)
    fast = sdf.witnesses(points, state, velocity=np.eye(9)[0] * 1.8, **options)
    assert at_rest.index[0, 1] != 4
    assert fast.index[0, 1] == 4


def test_an_empty_cloud_means_no_witness(sdf):
    found = sdf.query(np.zeros((0, 3)), QR)
    assert np.isinf(found.distance).all()
    assert (found.point_index == -1).all()
    assert not found.gradient.any()


def test_floor_heights_are_those_of_the_lowest_corners(robot, sdf):
    found = sdf.floor_witnesses(robot.state(QR))
    parts = collision_parts()
    for body, T in enumerate(robot.link_poses(QR)):
        corners = np.concatenate([part.vertices for part in parts[body]]) @ T[:3, :3].T + T[:3, 3]
        expected = np.inf if body == 0 else corners[:, 2].min()
        assert found.distance[body, 0] == pytest.approx(expected)
    step = 1e-6
    for e in np.eye(9):
        plus = sdf.floor_witnesses(robot.state(integrate(QR, e, step))).distance[1:, 0]
        minus = sdf.floor_witnesses(robot.state(integrate(QR, -e, step))).distance[1:, 0]
        np.testing.assert_allclose(
            found.gradient[1:, 0] @ e, (plus - minus) / (2 * step), atol=1e-6
        )


def test_own_arm_is_told_from_the_world(robot, sdf):
    state = robot.state(QR)
    corners = collision_parts()[5][0].vertices @ state.link_poses[5, :3, :3].T
    on_surface = corners + state.link_poses[5, :3, 3]
    beside = on_surface + np.array([0.0, 0.0, 3.0])
    assert sdf.on_arm(on_surface, state, 0.005).all()
    assert not sdf.on_arm(beside, state, 0.005).any()


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_a_cloud_that_is_not_finite_is_refused_with_the_cure(robot, sdf, wrong):
    points, state = np.ones((3, 3)), robot.state(QR)
    points[1, 2] = wrong
    for ask in (
        lambda: sdf.query(points, QR),
        lambda: sdf.witnesses(points, state, count=8, spacing=0.05, cutoff=1.0),
        lambda: sdf.on_arm(points, state, 0.005),
        lambda: sdf.link_distance(0, points),
    ):
        with pytest.raises(CloudError, match="points: expected finite numbers; drop invalid depth"):
            ask()


def test_a_cloud_of_another_shape_is_refused(sdf):
    with pytest.raises(CloudError, match=r"points: expected shape \(N, 3\), got \(3,\)"):
        sdf.query(np.zeros(3), QR)


def test_a_body_that_is_not_there_is_refused(sdf):
    for body in (-1, 9):
        with pytest.raises(QueryError, match=f"body {body}: expected 0 to 8"):
            sdf.link_distance(body, np.zeros((1, 3)))


@pytest.mark.parametrize(
    "wrong", [{"count": 0}, {"spacing": np.zeros(3)}, {"velocity": np.zeros(10)}]
)
def test_what_does_not_fit_the_robot_never_reaches_compiled_code(robot, sdf, wrong):
    options = {"count": 1, "spacing": 0.0, "cutoff": 1.0} | wrong
    with pytest.raises(QueryError, match="expected count >= 1, 9 spacings and 9 velocities"):
        sdf.witnesses(np.ones((1, 3)), robot.state(QR), **options)


def test_an_unknown_geometry_is_refused(robot):
    with pytest.raises(UnknownNameError, match="did you mean 'hull'"):
        RobotSdf.load(robot, "hul")


@pytest.mark.parametrize("body", range(9))
def test_where_several_surface_points_are_nearest_one_of_them_gives_the_gradient(robot, sdf, body):
    """On corners, edges and faces, and in the middle of a part."""
    state = robot.state(QR)
    pose = state.link_poses[body]
    for part in collision_parts()[body]:
        a, b, c = part.vertices[part.faces[0]]
        for local in (a, (a + b) / 2, (a + b + c) / 3, part.vertices.mean(axis=0)):
            point = pose[:3, :3] @ local + pose[:3, 3]
            found = sdf.witnesses(point[None], state, count=1, spacing=0.0, cutoff=np.inf)
            normal, gradient = found.normal[body, 0], found.gradient[body, 0]
            assert np.linalg.norm(normal) == pytest.approx(1.0)
            expected = -normal @ point_jacobian(state, body, point)
            np.testing.assert_allclose(gradient, expected, atol=1e-12)
