"""n perceptrons evaluated as one, by batched matrix products."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, cast

import torch as th
from torch import nn
from torch.autograd.function import once_differentiable


class EnsembleLinear(nn.Module):
    """n independent linear layers in one batched product, (n, B, in) -> (n, B, out).

    Weights and biases are drawn as `torch.nn.Linear` draws them, uniformly within
    1 / sqrt(in), each critic its own.
    """

    def __init__(self, n: int, in_features: int, out_features: int) -> None:
        super().__init__()
        bound = 1.0 / math.sqrt(in_features)
        self.weight = nn.Parameter(th.empty(n, in_features, out_features).uniform_(-bound, bound))
        self.bias = nn.Parameter(th.empty(n, 1, out_features).uniform_(-bound, bound))

    def forward(self, x: th.Tensor) -> th.Tensor:
        """Apply layer i to x[i]."""
        return th.baddbmm(self.bias, x, self.weight)


class _Heads(th.autograd.Function):
    """W x^T + b of n critics: a product with few outputs, in the layouts that are fast.

    Batched products with one or two columns are five times slower than with one or two rows, in
    both directions; autograd would choose the columns.
    """

    @staticmethod
    def forward(ctx: Any, x: th.Tensor, weight: th.Tensor, bias: th.Tensor) -> th.Tensor:
        ctx.save_for_backward(x, weight)
        return th.baddbmm(bias, weight, x.transpose(1, 2))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: th.Tensor) -> tuple[th.Tensor | None, ...]:
        x, weight = ctx.saved_tensors
        needs_x, needs_weight, needs_bias = ctx.needs_input_grad
        columns = gradient.transpose(1, 2)
        by_x = None
        if needs_x:
            by_x = columns * weight if weight.shape[1] == 1 else th.bmm(columns, weight)
        by_weight = th.bmm(gradient, x) if needs_weight else None
        by_bias = gradient.sum(dim=2, keepdim=True) if needs_bias else None
        return by_x, by_weight, by_bias


class EnsembleHeads(nn.Module):
    """n independent linear layers with few outputs, (n, B, in) -> (n, out, B).

    Weights and biases are drawn as those of `EnsembleLinear`.
    """

    def __init__(self, n: int, in_features: int, out_features: int) -> None:
        super().__init__()
        bound = 1.0 / math.sqrt(in_features)
        self.weight = nn.Parameter(th.empty(n, out_features, in_features).uniform_(-bound, bound))
        self.bias = nn.Parameter(th.empty(n, out_features, 1).uniform_(-bound, bound))

    def forward(self, x: th.Tensor) -> th.Tensor:
        """Apply layer i to x[i]."""
        heads: th.Tensor = _Heads.apply(  # type: ignore[no-untyped-call]
            x, self.weight, self.bias
        )
        return heads


class EnsembleLayerNorm(nn.Module):
    """n layer normalisations, each with its own scale and shift, on (n, B, features)."""

    def __init__(self, n: int, features: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(th.ones(n, 1, features))
        self.bias = nn.Parameter(th.zeros(n, 1, features))

    def forward(self, x: th.Tensor) -> th.Tensor:
        """Normalise the last dimension, then scale and shift."""
        return th.addcmul(self.bias, nn.functional.layer_norm(x, x.shape[-1:]), self.weight)


def ensemble_mlp(
    n: int, sizes: list[int], activation_fn: type[nn.Module], *, layer_norm: bool
) -> nn.Sequential:
    """Build n perceptrons of one shape, (n, B, sizes[0]) -> (n, sizes[-1], B).

    Args:
        n: Number of networks.
        sizes: Width of the input, of each hidden layer and of the output.
        activation_fn: Activation after each hidden layer.
        layer_norm: Whether to normalise before each activation, as DroQ does.
    """
    layers: list[nn.Module] = []
    for width_in, width_out in pairwise(sizes[:-1]):
        layers.append(EnsembleLinear(n, width_in, width_out))
        if layer_norm:
            layers.append(EnsembleLayerNorm(n, width_out))
        # The layer before it needs no output of its own for its gradient.
        layers.append(nn.ReLU(inplace=True) if activation_fn is nn.ReLU else activation_fn())
    return nn.Sequential(*layers, EnsembleHeads(n, sizes[-2], sizes[-1]))


def with_constant_part(ensemble: nn.Sequential, fixed: th.Tensor, x: th.Tensor) -> th.Tensor:
    """What `ensemble_mlp` makes of two parts side by side, if only the second has a gradient.

    The first layer is a product for each part. That of `x` is as narrow as `x` in both directions;
    one product of both would compute the gradient of all inputs and drop most of it.

    Args:
        ensemble: From `ensemble_mlp`, with weights that need no gradient.
        fixed: First inputs, shape (B, k), without gradient.
        x: The other inputs, shape (B, m).

    Returns:
        Outputs, shape (n, outputs, B).
    """
    first, *others = ensemble
    if not isinstance(first, EnsembleLinear):
        # Without hidden layers there is nothing to save.
        both = th.cat([fixed, x], dim=1)
        n = len(cast(EnsembleHeads, first).weight)
        return cast(th.Tensor, ensemble(both.expand(n, -1, -1)))
    by_fixed, by_x = th.split(first.weight, [fixed.shape[1], x.shape[1]], dim=1)
    hidden = th.baddbmm(first.bias, fixed.expand(len(by_fixed), -1, -1), by_fixed)
    hidden = th.baddbmm(hidden, x.expand(len(by_x), -1, -1), by_x)
    for layer in others:
        hidden = layer(hidden)
    return hidden


@contextmanager
def constant(module: nn.Module) -> Iterator[None]:
    """Make the weights of a module constants for what is computed inside."""
    weights = [weight for weight in module.parameters() if weight.requires_grad]
    for weight in weights:
        weight.requires_grad_(False)
    try:
        yield
    finally:
        for weight in weights:
            weight.requires_grad_(True)
