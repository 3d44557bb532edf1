"""What packing keeps of distances and gradients."""

import numpy as np
import pytest

from horf_env.sdf.packing import pack, unpack

AXES = np.vstack([np.eye(3), -np.eye(3)])


@pytest.fixture(scope="module")
def nodes():
    rng = np.random.default_rng(0)
    gradients = np.vstack([AXES, rng.normal(size=(5000, 3))])
    gradients /= np.linalg.norm(gradients, axis=1, keepdims=True)
    return np.column_stack([rng.uniform(-0.05, 0.09, len(gradients)), gradients])


def unpacked(packed, step):
    nodes = np.empty((len(packed), 4), dtype=np.float32)
    unpack(packed, step, nodes)
    return nodes


def test_distances_are_at_most_a_step_too_small_and_gradients_keep_their_direction(nodes):
    packed, step = pack(nodes)
    back = unpacked(packed, step)
    short = nodes[:, 0] - back[:, 0]
    assert step < 4e-6
    assert short.min() >= -1e-8
    assert short.max() <= step
    np.testing.assert_allclose(back[:, 1:], nodes[:, 1:], atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(back[:, 1:], axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(back[: len(AXES), 1:], AXES, atol=1e-6)


def test_packing_again_changes_nothing(nodes):
    packed, step = pack(nodes)
    again, same_step = pack(unpacked(packed, step))
    assert same_step == step
    np.testing.assert_array_equal(again, packed)
