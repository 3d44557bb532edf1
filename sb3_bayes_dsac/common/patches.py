"""First convolution of an image encoder, from bytes to features without an image of floats."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, Final

import torch as th
from torch import nn
from torch.autograd.function import once_differentiable

# Side and stride of the convolution, in pixels. Half of the cost of an encoder sits in its first
# layer; stride 4 instead of 2 makes a gradient step about three times cheaper.
PATCH: Final = 4
# Largest value of a pixel stored as a byte.
MAX_BYTE: Final = 255.0
# Patches that become floats at a time: 0.66 MB at five channels, which stay in the second-level
# cache. All at once they would be 16 MB of new memory, whose first touch costs more than the
# product.
CHUNK: Final = 2048


def byte_patches(images: th.Tensor) -> th.Tensor:
    """Patches of 4 x 4 pixels, one a row: (B, C, H, W) -> (B * H // 4 * W // 4, C * 16).

    Args:
        images: Bytes; rows and columns beyond a multiple of 4 are left out.
    """
    n, channels, height, width = images.shape
    height, width = height // PATCH, width // PATCH
    images = images[:, :, : height * PATCH, : width * PATCH]
    steps = (*images.stride()[:3], images.storage_offset())
    if images.stride(3) != 1 or any(step % PATCH for step in steps):  # rows are no whole words
        images = images.contiguous()
    # Four neighbouring bytes are one integer, so that four times fewer elements move. Gathering by
    # a list of places takes two thirds of the time of a permuted copy.
    words = images.view(th.int32).flatten(1)
    order = _patch_order(channels, height, width, images.device)
    rows = words.gather(1, order.expand(n, -1))
    return rows.view(n * height * width, channels * PATCH).view(th.uint8)


@lru_cache(maxsize=8)
def _patch_order(channels: int, height: int, width: int, device: th.device) -> th.Tensor:
    """Where the words of all patches of an image are, patch after patch."""
    places = th.arange(channels * height * PATCH * width, device=device)
    places = places.view(channels, height, PATCH, width)
    return places.permute(1, 3, 0, 2).flatten()


class _ByteProduct(th.autograd.Function):
    """x W^T + b for rows of bytes; they are kept as bytes between forward and backward."""

    @staticmethod
    def forward(ctx: Any, x: th.Tensor, weight: th.Tensor, bias: th.Tensor) -> th.Tensor:
        ctx.save_for_backward(x, weight)
        out = weight.new_empty(len(x), len(weight))
        for rows, floats in _chunks(x, weight):
            th.addmm(bias, floats, weight.t(), out=out[rows])
        return out

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: th.Tensor) -> tuple[th.Tensor | None, ...]:
        x, weight = ctx.saved_tensors
        by_weight = th.zeros_like(weight)
        for rows, floats in _chunks(x, weight):
            by_weight += gradient[rows].t() @ floats
        return None, by_weight, gradient.sum(dim=0)


def _chunks(x: th.Tensor, weight: th.Tensor) -> Iterator[tuple[slice, th.Tensor]]:
    """Some rows after the other, as floats in memory that the next chunk overwrites."""
    scratch = weight.new_empty(min(CHUNK, len(x)), x.shape[1])
    for first in range(0, len(x), CHUNK):
        part = x[first : first + CHUNK]
        yield slice(first, first + len(part)), scratch[: len(part)].copy_(part)


class PatchConvolution(nn.Module):
    """Convolution whose stride is its kernel's side, and its ReLU; bytes as one matrix product.

    Bytes are cut into patches four at a time, become floats once, and take the factor 1/255 from
    the weights. Products of patches come out with the channels last, the layout in which the
    next convolutions are fastest. Floats go through an ordinary convolution with the same weights.

    Args:
        in_channels: Channels of the image.
        out_channels: Channels of the output.
    """

    def __init__(self, in_channels: int, out_channels: int) -> None:
        super().__init__()
        self.convolution = nn.Conv2d(in_channels, out_channels, kernel_size=PATCH, stride=PATCH)

    def forward(self, images: th.Tensor) -> th.Tensor:
        """Map images (B, C, H, W) to (B, out_channels, H // 4, W // 4)."""
        if images.dtype != th.uint8:
            return nn.functional.relu(self.convolution(images))
        n, _, height, width = images.shape
        height, width = height // PATCH, width // PATCH
        weight = self.convolution.weight.flatten(1) / MAX_BYTE
        products: th.Tensor = _ByteProduct.apply(  # type: ignore[no-untyped-call]
            byte_patches(images), weight, self.convolution.bias
        )
        return products.relu_().view(n, height, width, -1).permute(0, 3, 1, 2)
