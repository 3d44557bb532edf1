import numpy as np
import pytest
import trimesh

from horf_env.perception import CameraModel, CloudHistory, DepthCamera, remove_floor, unproject

MODEL = CameraModel()


def pose(x, y, theta):
    T = trimesh.transformations.rotation_matrix(theta, [0, 0, 1])
    T[:2, 3] = x, y
    return T @ MODEL.T_base_camera


def test_projecting_the_points_gives_the_image_back():
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.2, 5, (48, 64)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.3] = 0.0
    T = pose(3, -2, 1.1)
    points = unproject(depth, MODEL, T)
    assert len(points) == (depth > 0).sum()
    in_camera = (points - T[:3, 3]) @ T[:3, :3]
    fx, fy = MODEL.focal_lengths
    columns = np.floor(fx * in_camera[:, 0] / in_camera[:, 2] + 32).astype(int)
    rows = np.floor(fy * in_camera[:, 1] / in_camera[:, 2] + 24).astype(int)
    again = np.zeros_like(depth)
    again[rows, columns] = in_camera[:, 2]
    np.testing.assert_allclose(again, depth, atol=1e-5)


def test_points_lie_on_the_surfaces_that_were_seen():
    box = trimesh.creation.box([0.6, 0.8, 1.0])
    box.apply_translation([2.0, 0.2, 0.5])
    floor = trimesh.creation.box([20, 20, 0.2])
    floor.apply_translation([0, 0, -0.1])
    mesh = trimesh.util.concatenate([box, floor])
    camera = DepthCamera(MODEL)
    camera.set_scene(mesh.vertices, mesh.faces)
    T = pose(0.1, 0.3, -0.1)
    points = unproject(camera.render(T), MODEL, T)
    outside = np.maximum(np.abs(points - [2.0, 0.2, 0.5]) - [0.3, 0.4, 0.5], 0.0)
    on_box = np.linalg.norm(outside, axis=1) < 1e-4
    on_floor = np.abs(points[:, 2]) < 1e-4
    assert on_box.sum() > 300
    assert on_floor.sum() > 300
    assert (on_box | on_floor).all()
    np.testing.assert_array_equal(remove_floor(points), points[points[:, 2] >= 0.03])
    assert remove_floor(points)[:, 2].min() >= 0.03


def test_blind_frames_have_no_points():
    assert unproject(np.zeros((48, 64), np.float32), MODEL, np.eye(4)).shape == (0, 3)
    assert remove_floor(np.empty((0, 3))).shape == (0, 3)


def test_history_keeps_the_last_frames_in_order():
    history = CloudHistory(3)
    assert history.points().shape == (0, 3)
    for k in range(5):
        history.add(np.full((k + 1, 3), float(k)))
    assert history.points()[:, 0].tolist() == [2.0] * 3 + [3.0] * 4 + [4.0] * 5
    history.clear()
    assert history.points().shape == (0, 3)


def test_frames_without_points_push_old_ones_out():
    history = CloudHistory(2)
    history.add(np.ones((4, 3)))
    history.add(np.empty((0, 3)))
    assert len(history.points()) == 4
    history.add(np.empty((0, 3)))
    assert len(history.points()) == 0


def test_an_empty_history_is_refused():
    with pytest.raises(ValueError, match="at least 1"):
        CloudHistory(0)
