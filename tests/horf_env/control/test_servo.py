"""The position servo, open and closed loop."""

import numpy as np
from scipy.spatial.transform import Rotation

from horf_env.control import deviation, servo_twist
from horf_env.robot import LIMITS

SCALE = LIMITS["ld60"].twist_scale


def pose(position, rotvec):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotvec).as_matrix()
    T[:3, 3] = position
    return T


def test_deviation_is_given_in_the_axes_of_the_base():
    R_base = Rotation.from_euler("z", 0.5 * np.pi).as_matrix()
    ee, goal = pose([1, 0, 0.5], [0, 0, 0]), pose([1, 2, 0.5], [0.3, 0, 0])
    np.testing.assert_allclose(deviation(ee, goal, R_base), [2, 0, 0, 0, -0.3, 0], atol=1e-12)


def test_the_twist_is_within_an_action_and_keeps_its_direction():
    far = np.array([6.0, -3.0, 0.3, 0.0, 2.0, -1.0])
    twist = servo_twist(far, SCALE)
    assert (np.abs(twist) <= SCALE + 1e-12).all()
    assert np.allclose(np.cross(twist[:3], far[:3]), 0)
    assert np.allclose(np.cross(twist[3:], far[3:]), 0)
    assert not servo_twist(np.zeros(6), SCALE).any()


def test_following_the_twist_reaches_the_goal():
    T, goal = pose([0, 0, 1], [0, 0, 0]), pose([1.2, -0.8, 0.4], [0.4, 1.0, -0.7])
    for _ in range(200):
        twist = servo_twist(deviation(T, goal, np.eye(3)), SCALE)
        T[:3, 3] += 0.05 * twist[:3]
        T[:3, :3] = Rotation.from_rotvec(0.05 * twist[3:]).as_matrix() @ T[:3, :3]
    assert np.linalg.norm(deviation(T, goal, np.eye(3))) < 1e-3
