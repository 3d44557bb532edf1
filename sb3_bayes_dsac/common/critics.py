"""Critics in an ensemble: n networks evaluated as one."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, ClassVar

import torch as th
from gymnasium import spaces
from stable_baselines3.common.policies import BaseModel
from stable_baselines3.common.preprocessing import get_action_dim
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.type_aliases import PyTorchObs
from torch import nn
from torch.func import functional_call

from sb3_bayes_dsac.errors import ArgumentError


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
    """Build n perceptrons of one shape, (n, B, sizes[0]) -> (n, B, sizes[-1]).

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
        layers.append(activation_fn())
    return nn.Sequential(*layers, EnsembleLinear(n, sizes[-2], sizes[-1]))


class EnsembleCritics(BaseModel):
    """n critics of one shape; what their outputs mean is said by each subclass.

    Args:
        observation_space: Observation space.
        action_space: Action space.
        net_arch: Widths of the hidden layers.
        features_extractor: Encoder of observations, shared with the actor or not.
        features_dim: Numbers that the encoder gives.
        activation_fn: Activation after each hidden layer.
        normalize_images: Whether images are divided by 255.
        n_critics: Number of critics, at least 1.
        layer_norm: Whether to normalise before each activation; helps at high replay ratios.

    Raises:
        ArgumentError: `n_critics` is below 1.
    """

    n_outputs: ClassVar[int]
    features_extractor: BaseFeaturesExtractor

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        action_space: spaces.Box,
        net_arch: list[int],
        features_extractor: BaseFeaturesExtractor,
        features_dim: int,
        activation_fn: type[nn.Module] = nn.ReLU,
        normalize_images: bool = True,
        n_critics: int = 2,
        layer_norm: bool = False,
    ) -> None:
        if n_critics < 1:
            raise ArgumentError("n_critics", n_critics, "give at least 1 critic")
        super().__init__(
            observation_space,
            action_space,
            features_extractor=features_extractor,
            normalize_images=normalize_images,
        )
        self.n_critics = n_critics
        sizes = [features_dim + get_action_dim(action_space), *net_arch, self.n_outputs]
        self.ensemble = ensemble_mlp(n_critics, sizes, activation_fn, layer_norm=layer_norm)

    def encode(self, obs: PyTorchObs) -> th.Tensor:
        """Features of observations, shape (B, features_dim)."""
        return self.extract_features(obs, self.features_extractor)

    def outputs(self, features: th.Tensor, actions: th.Tensor, *, frozen: bool) -> th.Tensor:
        """What the last layers give, shape (n_critics, B, n_outputs).

        Args:
            features: Encoded observations, shape (B, features_dim).
            actions: Actions scaled to [-1, 1], shape (B, action_dim).
            frozen: Whether weights are constants, as the actor's loss needs them: the gradient
                reaches the actions, and none is computed for the weights.
        """
        x = th.cat([features, actions], dim=1)
        return self._apply_constant(x, slice(None)) if frozen else self._apply_all(x)

    def subset_outputs(
        self, features: th.Tensor, actions: th.Tensor, subset: th.Tensor
    ) -> th.Tensor:
        """As `outputs` with frozen weights, from some of the critics: (len(subset), B, n_outputs).

        Args:
            features: Encoded observations, shape (B, features_dim).
            actions: Actions scaled to [-1, 1], shape (B, action_dim).
            subset: Indices of the critics.
        """
        return self._apply_constant(th.cat([features, actions], dim=1), subset)

    def _apply_all(self, x: th.Tensor) -> th.Tensor:
        """Outputs of all critics for the same inputs (B, in)."""
        outputs: th.Tensor = self.ensemble(x.expand(self.n_critics, -1, -1))
        return outputs

    def _apply_constant(self, x: th.Tensor, critics: th.Tensor | slice) -> th.Tensor:
        """Outputs of some critics for the same inputs (B, in), with weights as constants."""
        weights = {k: weight.detach()[critics] for k, weight in self.ensemble.named_parameters()}
        n = len(next(iter(weights.values())))
        outputs: th.Tensor = functional_call(self.ensemble, weights, (x.expand(n, -1, -1),))
        return outputs


class GaussianCritics(EnsembleCritics):
    """n critics of the return's distribution, Z_i(s, a) ~ N(Q_i, sigma_i^2).

    One head gives the mean and the raw deviation, sigma = softplus(raw), as in DSAC-T. Arguments
    are those of `EnsembleCritics`.
    """

    n_outputs: ClassVar[int] = 2

    def forward(self, obs: PyTorchObs, actions: th.Tensor) -> tuple[th.Tensor, th.Tensor]:
        """Means and standard deviations of the return, both of shape (n_critics, B).

        Args:
            obs: Batch of observations.
            actions: Batch of actions scaled to [-1, 1], shape (B, action_dim).
        """
        return self.evaluate(self.encode(obs), actions)

    def evaluate(
        self, features: th.Tensor, actions: th.Tensor, *, frozen: bool = False
    ) -> tuple[th.Tensor, th.Tensor]:
        """As `forward`, from features of shape (B, features_dim); `frozen` as in `outputs`."""
        mean, raw_std = self.outputs(features, actions, frozen=frozen).unbind(dim=-1)
        return mean, nn.functional.softplus(raw_std)
