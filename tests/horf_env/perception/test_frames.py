import numpy as np
import pytest

from horf_env.errors import SettingError
from horf_env.perception import (
    CameraModel,
    FrameStack,
    coarser,
    dequantise_depth,
    quantise_depth,
)

MODEL = CameraModel()


def frame(value):
    return np.full((3, 4), value, dtype=np.uint8)


def test_round_trip_error_is_at_most_half_a_step():
    depth = np.linspace(MODEL.near, MODEL.far, 10_001, dtype=np.float32)[None]
    error = dequantise_depth(quantise_depth(depth, MODEL), MODEL) - depth
    step = (MODEL.far - MODEL.near) / 254
    assert np.abs(error).max() <= 0.5 * step + 1e-5
    assert np.abs(error).max() <= 0.0096  # what the documentation promises


def test_grey_values_cover_the_range_and_zero_means_invalid():
    depth = np.array([[0.0, MODEL.near, MODEL.far]], dtype=np.float32)
    grey = quantise_depth(depth, MODEL)
    assert grey.dtype == np.uint8
    assert grey.tolist() == [[0, 1, 255]]
    np.testing.assert_allclose(dequantise_depth(grey, MODEL), depth, atol=1e-6)


def test_reset_fills_the_stack_with_the_first_frame():
    stack = FrameStack(5)
    stack.reset(frame(1))
    stack.push(frame(2))
    assert stack.reset(frame(9))[:, 0, 0].tolist() == [9] * 5


def test_oldest_frame_comes_first_and_is_dropped_first():
    stack = FrameStack(3)
    stack.reset(frame(1))
    stack.push(frame(2))
    assert stack.push(frame(3))[:, 0, 0].tolist() == [1, 2, 3]
    assert stack.push(frame(4))[:, 0, 0].tolist() == [2, 3, 4]


def test_no_two_observations_share_memory():
    stack = FrameStack(2)
    source = frame(1)
    first = stack.reset(source)
    second = stack.push(source)
    assert not np.shares_memory(first, second)
    source[:] = 7
    first[:] = 8
    second[:] = 9
    assert stack.push(frame(2))[:, 0, 0].tolist() == [1, 2]


def test_pushing_before_reset_is_refused():
    with pytest.raises(RuntimeError, match="reset"):
        FrameStack().push(frame(1))


def test_an_empty_stack_is_refused():
    with pytest.raises(ValueError, match="at least 1"):
        FrameStack(0)


def test_a_coarser_image_has_the_rays_of_a_coarser_camera():
    fine, coarse = CameraModel(width=96, height=72), CameraModel(width=32, height=24)
    kept = fine.rays[coarser(fine, (32, 24))]
    np.testing.assert_allclose(kept, coarse.rays, atol=1e-12)
    np.testing.assert_array_equal(fine.rays[coarser(fine, (96, 72))], fine.rays)
    between = fine.rays[coarser(fine, (64, 48))]
    assert np.abs(between - CameraModel().rays).max() < 1.0 / fine.focal_lengths[0]


@pytest.mark.parametrize("size", [(65, 48), (64, 0)])
def test_an_image_finer_than_the_cameras_is_refused(size):
    with pytest.raises(SettingError, match="setting 'image': expected 1x1 to 64x48 pixels"):
        coarser(CameraModel(), size)
