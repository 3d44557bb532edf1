"""Points on bodies, against products with the pose one by one."""

import numpy as np
from scipy.spatial.transform import Rotation

from horf_env.robot.placing import placed_points


def test_points_of_each_body_move_with_its_pose():
    rng = np.random.default_rng(0)
    points, starts = rng.normal(size=(7, 3)), np.array([0, 4, 4, 7])  # the second body has none
    poses = np.tile(np.eye(4), (3, 1, 1))
    poses[:, :3, :3] = Rotation.random(3, random_state=1).as_matrix()
    poses[:, :3, 3] = rng.normal(size=(3, 3))
    expected = [
        poses[body, :3, :3] @ point + poses[body, :3, 3]
        for body, point in zip([0, 0, 0, 0, 2, 2, 2], points, strict=True)
    ]
    np.testing.assert_allclose(placed_points(points, starts, poses), expected, atol=1e-12)
