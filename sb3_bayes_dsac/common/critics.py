"""Critics in an ensemble, what they have in common and those of the return's distribution."""

from __future__ import annotations

from typing import Any, ClassVar

import torch as th
from gymnasium import spaces
from stable_baselines3.common.policies import BaseModel
from stable_baselines3.common.preprocessing import get_action_dim
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.type_aliases import PyTorchObs
from torch import nn
from torch.func import functional_call

from sb3_bayes_dsac.common.encoders import encode
from sb3_bayes_dsac.common.ensemble import constant, ensemble_mlp, with_constant_part
from sb3_bayes_dsac.errors import require_count


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
        ArgumentError: `n_critics` is no whole number of at least 1.
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
        require_count("n_critics", n_critics)
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
        return encode(
            self.features_extractor,
            obs,
            self.observation_space,
            normalize_images=self.normalize_images,
        )

    def outputs(self, features: th.Tensor, actions: th.Tensor, *, frozen: bool) -> th.Tensor:
        """What the last layers give, shape (n_critics, n_outputs, B).

        Args:
            features: Encoded observations, shape (B, features_dim).
            actions: Actions scaled to [-1, 1], shape (B, action_dim).
            frozen: Whether weights are constants, as the actor's loss needs them: the gradient
                reaches the actions, and none is computed for the weights.
        """
        if frozen:
            with constant(self.ensemble):
                return with_constant_part(self.ensemble, features, actions)
        x = th.cat([features, actions], dim=1)
        outputs: th.Tensor = self.ensemble(x.expand(self.n_critics, -1, -1))
        return outputs

    def subset_outputs(
        self, features: th.Tensor, actions: th.Tensor, subset: th.Tensor
    ) -> th.Tensor:
        """As `outputs` with frozen weights, of some critics only: (len(subset), n_outputs, B).

        Args:
            features: Encoded observations, shape (B, features_dim).
            actions: Actions scaled to [-1, 1], shape (B, action_dim).
            subset: Indices of the critics.
        """
        x = th.cat([features, actions], dim=1).expand(len(subset), -1, -1)
        weights = {k: weight.detach()[subset] for k, weight in self.ensemble.named_parameters()}
        outputs: th.Tensor = functional_call(self.ensemble, weights, (x,))
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
        mean, raw_std = self.outputs(features, actions, frozen=frozen).unbind(dim=1)
        return mean, nn.functional.softplus(raw_std)
