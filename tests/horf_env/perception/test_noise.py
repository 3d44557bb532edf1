import numpy as np
import pytest

from horf_env.perception import CameraModel, DisparityNoise

MODEL = CameraModel(width=200, height=150)
SCALE = 427.0 * 0.05  # focal length times baseline


def image(depth):
    return np.full((150, 200), depth, dtype=np.float32)


@pytest.mark.parametrize(("depth", "spread"), [(1.0, 0.00375), (2.0, 0.0150), (3.0, 0.0337)])
def test_spread_grows_with_the_square_of_the_depth(depth, spread):
    noisy = DisparityNoise().apply(image(depth), MODEL, np.random.default_rng(0))
    assert noisy.std() == pytest.approx(spread, rel=0.05)
    assert noisy.mean() == pytest.approx(depth, abs=0.1 * spread + 0.01 * depth**2)


def test_disparities_lie_on_the_sensors_grid():
    noisy = DisparityNoise().apply(image(1.7), MODEL, np.random.default_rng(0))
    steps = 32.0 * SCALE / noisy.astype(np.float64)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-3)
    assert len(np.unique(noisy)) > 5


def test_without_randomness_only_the_grid_remains():
    noisy = DisparityNoise(subpixel_sd=0.0).apply(image(2.0), MODEL, np.random.default_rng(0))
    assert np.ptp(noisy) == 0.0
    assert abs(noisy[0, 0] - 2.0) <= 0.5 / 32 * 2.0**2 / SCALE + 1e-6


def test_invalid_pixels_stay_invalid_and_the_input_is_left_alone():
    depth = image(1.0)
    depth[:75] = 0.0
    before = depth.copy()
    noisy = DisparityNoise().apply(depth, MODEL, np.random.default_rng(0))
    assert not noisy[:75].any()
    assert noisy[75:].all()
    np.testing.assert_array_equal(depth, before)


def test_what_leaves_the_range_becomes_invalid():
    noisy = DisparityNoise().apply(image(MODEL.far), MODEL, np.random.default_rng(0))
    assert 0.3 < (noisy == 0).mean() < 0.7
    assert noisy.max() <= MODEL.far


def test_no_disparity_left_means_no_depth():
    far = CameraModel(width=200, height=150, far=1e6)
    noisy = DisparityNoise(subpixel_sd=1.0).apply(image(1e4), far, np.random.default_rng(0))
    assert np.isfinite(noisy).all()
    assert (noisy == 0).any()


def test_equal_generators_give_equal_noise():
    first, second = (
        DisparityNoise().apply(image(1.5), MODEL, np.random.default_rng(7)) for _ in range(2)
    )
    np.testing.assert_array_equal(first, second)
