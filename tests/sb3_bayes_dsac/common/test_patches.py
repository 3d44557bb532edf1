from __future__ import annotations

import pytest
import torch as th

from sb3_bayes_dsac.common import patches
from sb3_bayes_dsac.common.patches import PatchConvolution, byte_patches


def test_a_patch_lists_its_channels_row_by_row() -> None:
    images = th.arange(2 * 3 * 8 * 12).to(th.uint8).view(2, 3, 8, 12)
    rows = byte_patches(images).view(2, 2, 3, 48)
    assert th.equal(rows[1, 1, 2], images[1, :, 4:8, 8:12].flatten())


WINDOWS = th.arange(2 * 6 * 8 * 12).to(th.uint8).view(2, 6, 8, 12)


@pytest.mark.parametrize(
    "images",
    [
        WINDOWS[:, 1:],  # successors in a window of frames
        WINDOWS[:, :, :, 1:9],  # begins within a word
        WINDOWS[:, :, 1:],  # begins within a patch
        WINDOWS[:, :, ::2],
        WINDOWS.flatten()[3:-9].view(2, 1, 6, 95)[..., :92],  # rows are no whole words
        WINDOWS.permute(0, 1, 3, 2),
        WINDOWS.view(2, 8, 12, 6).permute(0, 3, 1, 2),  # channels last
    ],
)
def test_the_layout_of_images_does_not_matter(images: th.Tensor) -> None:
    assert th.equal(
        byte_patches(images), byte_patches(images.clone(memory_format=th.contiguous_format))
    )


@pytest.mark.parametrize("chunk", [7, 8192])
@pytest.mark.parametrize("size", [(48, 64), (24, 32), (4, 4), (37, 41), (5, 10)])
def test_bytes_and_floats_give_the_same_features_and_gradients(
    monkeypatch: pytest.MonkeyPatch, size: tuple[int, int], chunk: int
) -> None:
    monkeypatch.setattr(patches, "CHUNK", chunk)
    th.manual_seed(0)
    layer = PatchConvolution(5, 16).double()
    images = th.randint(0, 256, (3, 5, *size), dtype=th.uint8)
    from_bytes, from_floats = layer(images), layer(images.double() / 255)
    th.testing.assert_close(from_bytes, from_floats)
    weights = th.randn_like(from_floats)
    parameters = list(layer.parameters())
    ours = th.autograd.grad((from_bytes * weights).sum(), parameters)
    theirs = th.autograd.grad((from_floats * weights).sum(), parameters)
    for a, b in zip(ours, theirs, strict=True):
        th.testing.assert_close(a, b)
