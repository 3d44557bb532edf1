import numpy as np
import pytest

from horf_env.robot import ARM_READY, LIMITS, integrate
from horf_env.robot.limits import ARM_UPPER
from horf_env.scenes.scene import Box, Cylinder
from horf_env.simulation import WorldState

STEP = 0.05  # s, a control step
FRONT = 0.365 + 0.0125 * (np.cos(np.pi / 12) + np.sin(np.pi / 12))  # edge of the camera, m
FORWARD = np.array([1.0, 0, 0, 0, 0, 0, 0, 0, 0])
MIXED = np.array([0.7, -0.9, 0.3, -0.2, 0.4, 0.1, -0.5, 0.2, 0.6])


def drive(world, velocity, steps=60):
    """Move until contact or for some steps; the last result."""
    for _ in range(steps):
        result = world.move(velocity, STEP)
        if result.contact:
            break
    return result


def rest(configuration):
    return WorldState(np.asarray(configuration, dtype=float), np.zeros(9))


def test_kinematic_motion_is_the_exact_integral(make_world):
    world = make_world(base=(1.0, -2.0, 0.4))
    start = world.state.configuration
    result = world.move(MIXED, STEP)
    np.testing.assert_allclose(result.configuration, integrate(start, MIXED, STEP), atol=1e-12)
    np.testing.assert_allclose(world.state.configuration, result.configuration, atol=1e-12)
    np.testing.assert_allclose(result.velocity, MIXED)
    np.testing.assert_allclose(world.state.velocity, MIXED, atol=1e-12)
    assert result.contact is None


def test_kinematic_joints_stop_at_their_limits(make_world):
    world = make_world(arm=tuple(ARM_READY))
    velocity = np.zeros(9)
    velocity[8] = 2.61
    result = drive(world, velocity)
    assert result.configuration[9] == pytest.approx(ARM_UPPER[6])


@pytest.mark.parametrize("thickness", [0.0005, 0.005, 0.05])
@pytest.mark.parametrize("phase", [0.0, 0.037, 0.111, 0.173])
def test_a_thin_wall_is_not_tunnelled_at_four_metres_a_second(make_world, thickness, phase):
    wall = Box(center=(2.0 + phase, 0, 0.5), half_extents=(thickness, 3, 0.5), yaw=0.0)
    world = make_world(boxes=[wall])
    arm = (0.0, -1.5, 0.0, -2.8, 0.0, 1.5, 0.785)  # folded back: the base hits first
    world.set_state(rest([0, 0, 0, *arm]))
    result = drive(world, 4.0 * FORWARD)
    gap = 2.0 + phase - thickness - FRONT - result.configuration[0]
    assert result.contact == ("camera_link", "boxes[0]")
    assert -0.021 <= gap <= 0.001
    assert result.clearance.distance < 0


@pytest.mark.parametrize("angle", np.linspace(0.6, 3.0, 7))
def test_a_thin_post_stops_the_hand_when_the_base_turns_fast(make_world, angle):
    """At 4 rad/s the hand moves 14 cm a step, the post is 1 cm thick."""
    post = Cylinder(
        center=(0.65 * np.cos(angle), 0.65 * np.sin(angle), 0.75), radius=0.005, half_height=0.75
    )
    result = drive(make_world(cylinders=[post]), 4.0 * np.eye(9)[1])
    assert result.contact
    assert result.contact[1] == "cylinders[0]"
    assert result.configuration[2] < angle


@pytest.mark.parametrize("mode", ["kinematic", "dynamic"])
def test_a_robot_in_contact_does_not_move(make_world, mode):
    wall = Box(center=(1.0, 0, 0.2), half_extents=(0.1, 3, 0.2), yaw=0.0)
    world = make_world(mode=mode, boxes=[wall])
    stopped = drive(world, FORWARD)
    assert stopped.contact
    again = world.move(-FORWARD, STEP)
    assert again.contact == stopped.contact
    np.testing.assert_array_equal(again.configuration, stopped.configuration)


@pytest.mark.parametrize("mode", ["kinematic", "dynamic"])
def test_clearance_of_a_move_is_the_least_on_the_way(make_world, mode):
    """Past a post that is near only in the middle of the step."""
    post = Cylinder(center=(0.1, 0.30, 0.15), radius=0.01, half_height=0.15)
    world = make_world(mode=mode, cylinders=[post], base=(-0.75, 0.0, 0.0))
    world.set_state(WorldState(world.state.configuration, 4.0 * FORWARD))
    result = world.move(4.0 * FORWARD, 0.4)
    assert result.configuration[0] > 0.8
    assert result.clearance.distance == pytest.approx(0.04, abs=2e-3)
    assert world.clearance.distance > 0.09


@pytest.mark.parametrize("mode", ["kinematic", "dynamic"])
def test_equal_inputs_give_equal_motions(make_world, make_scene, mode):
    wall = Box(center=(2.5, 0, 0.5), half_extents=(0.1, 3, 0.5), yaw=0.3)
    velocities = np.random.default_rng(1).uniform(-0.5, 0.5, (20, 9)) + 0.8 * FORWARD
    scene = make_scene(boxes=[wall])
    world = make_world(mode=mode, boxes=[wall])

    def run():
        return np.array([world.move(v, STEP).configuration for v in velocities])

    first = run()
    world.set_scene(scene)
    np.testing.assert_array_equal(run(), first)
    world.set_state(rest([*scene.start.base, *scene.start.arm]))
    np.testing.assert_array_equal(run(), first)


def test_dynamic_motion_tracks_the_commanded_velocity(make_world):
    world = make_world(mode="dynamic")
    expected = world.state.configuration
    for _ in range(10):
        result = world.move(MIXED, STEP)
        expected = integrate(expected, MIXED, STEP)
    np.testing.assert_allclose(result.velocity, MIXED, atol=5e-3)
    np.testing.assert_allclose(result.configuration, expected, atol=1e-2)


def test_dynamic_base_does_not_slip_sideways(make_world):
    world = make_world(mode="dynamic")
    turning = np.array([1.5, 1.2, 0, 0, 0, 0, 0, 0, 0])
    before = drive(world, turning, steps=10).configuration
    after = world.move(turning, STEP).configuration
    moved, heading = after[:2] - before[:2], 0.5 * (before[2] + after[2])
    assert moved @ [np.cos(heading), np.sin(heading)] == pytest.approx(1.5 * STEP, rel=0.01)
    assert abs(moved @ [-np.sin(heading), np.cos(heading)]) < 1e-3


def test_dynamic_robot_stays_where_it_is_for_twenty_seconds(make_world):
    world = make_world(mode="dynamic", arm=(0.4, 1.0, 0.0, -0.5, 0.0, 1.5, 0.0))
    start = world.state.configuration
    result = drive(world, np.zeros(9), round(20.0 / STEP))
    np.testing.assert_allclose(result.configuration, start, atol=1e-9)
    np.testing.assert_allclose(result.velocity, np.zeros(9), atol=1e-9)


def test_dynamic_motion_equals_kinematic_motion_under_a_smooth_command(make_world):
    """All joints speed up and slow down at once, at up to two fifths of their accelerations."""
    period = 4.0
    largest = 0.8 * LIMITS["ld60"].acceleration * period / (4.0 * np.pi)
    signs = np.r_[1, np.resize([1, -1], 8)]
    speeds = signs * np.minimum(largest, np.r_[0.6, 0.6, np.full(7, 0.3)])
    exact, motors = make_world(), make_world(mode="dynamic")
    for time in np.arange(0.5 * STEP, period, STEP):
        velocity = speeds * (1.0 - np.cos(2.0 * np.pi * time / period))
        expected, result = exact.move(velocity, STEP), motors.move(velocity, STEP)
        np.testing.assert_allclose(result.velocity, expected.velocity, atol=3e-3)
        np.testing.assert_allclose(result.configuration, expected.configuration, atol=2.5e-3)
    assert result.contact is None


def test_dynamic_motors_have_limited_force(make_world):
    """Reversing from 4 m/s takes longer than one physics step, but not long."""
    world = make_world(mode="dynamic", arm=(0.0, -1.5, 0.0, -2.8, 0.0, 1.5, 0.785))
    start = np.r_[0, 0, 0, world.state.configuration[3:]]
    world.set_state(WorldState(start, 4.0 * FORWARD))
    first = world.move(-4.0 * FORWARD, 1 / 240)
    assert 3.5 < first.velocity[0] < 4.0
    assert drive(world, -4.0 * FORWARD, 10).velocity[0] == pytest.approx(-4.0, abs=0.01)


def test_dynamic_wall_is_not_tunnelled(make_world):
    wall = Box(center=(2.0, 0, 0.5), half_extents=(0.0005, 3, 0.5), yaw=0.0)
    world = make_world(mode="dynamic", boxes=[wall])
    result = drive(world, 4.0 * FORWARD)
    assert result.contact
    assert result.contact[1] == "boxes[0]"
    assert result.configuration[0] < 1.65
