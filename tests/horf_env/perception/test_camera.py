import io

import numpy as np
import pytest
import yourdfpy

from horf_env.errors import SettingError
from horf_env.perception import CameraModel
from horf_env.robot.description import urdf_text


def test_outermost_pixel_edges_span_the_fields_of_view():
    model = CameraModel(width=64, height=48)
    fx, fy = model.focal_lengths
    assert 2 * np.arctan(32 / fx) == pytest.approx(np.deg2rad(87))
    assert 2 * np.arctan(24 / fy) == pytest.approx(np.deg2rad(58))


def test_rays_pass_through_pixel_centres():
    model = CameraModel(width=4, height=2)
    fx, fy = model.focal_lengths
    assert model.rays.shape == (2, 4, 3)
    np.testing.assert_allclose(model.rays[0, 0], [-1.5 / fx, -0.5 / fy, 1.0])
    np.testing.assert_allclose(model.rays[1, 3], [1.5 / fx, 0.5 / fy, 1.0])


def test_pixels_need_not_be_square():
    fx, fy = CameraModel(width=64, height=48).focal_lengths
    assert fy / fx == pytest.approx(0.75 * np.tan(np.deg2rad(43.5)) / np.tan(np.deg2rad(29)))


def test_pose_is_a_rotation_with_the_stated_axes():
    pitch = np.deg2rad(15)
    T = CameraModel(pitch_up=pitch, position=(0.3, 0.1, 0.4)).T_base_camera
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    np.testing.assert_allclose(T[:3, 0], [0, -1, 0], atol=1e-12)  # image right = robot's right
    np.testing.assert_allclose(T[:3, 2], [np.cos(pitch), 0, np.sin(pitch)], atol=1e-12)
    np.testing.assert_allclose(T[:3, 3], [0.3, 0.1, 0.4])


def test_default_camera_sits_where_the_urdf_shows_it():
    urdf = yourdfpy.URDF.load(io.StringIO(urdf_text()), load_meshes=False)
    link = urdf.get_transform("camera_link", "base_link")
    T = CameraModel().T_base_camera
    np.testing.assert_allclose(T[:3, 3], link[:3, 3], atol=1e-9)
    np.testing.assert_allclose(T[:3, 2], link[:3, 0], atol=1e-6)  # the link looks along its x axis


@pytest.mark.parametrize(
    "wrong",
    [
        {"width": 0},
        {"horizontal_fov": np.pi},
        {"vertical_fov": 0.0},
        {"near": 0.0},
        {"near": 2.0, "far": 1.0},
        {"pitch_up": np.nan},
        {"position": (0.0, 0.3)},
    ],
)
def test_impossible_cameras_are_refused(wrong):
    with pytest.raises(SettingError, match="'camera': expected"):
        CameraModel(**wrong)


def test_range_limits_are_inclusive_and_the_rest_is_invalid():
    model = CameraModel(near=0.2, far=4.0)
    depth = np.array([[0.1999, 0.2, 4.0, 4.0001, np.inf, 0.0]], dtype=np.float32)
    np.testing.assert_allclose(model.within_range(depth), [[0, 0.2, 4.0, 0, 0, 0]])
