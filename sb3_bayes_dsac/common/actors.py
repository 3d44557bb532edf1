"""The actor of SB3's SAC, split so that features can come from elsewhere."""

from __future__ import annotations

from typing import Any, cast

import torch as th
from stable_baselines3.common.distributions import (
    SquashedDiagGaussianDistribution,
    StateDependentNoiseDistribution,
)
from stable_baselines3.common.type_aliases import PyTorchObs
from stable_baselines3.sac.policies import LOG_STD_MAX, LOG_STD_MIN
from stable_baselines3.sac.policies import Actor as SACActor
from torch import nn

from sb3_bayes_dsac.common.encoders import encode
from sb3_bayes_dsac.common.squashed_gaussian import squashed_sample


class Actor(SACActor):
    """SAC's squashed Gaussian (or gSDE) actor that also acts on features computed already.

    DSAC-T limits the logarithm of the deviation to [-20, 0.5]; here it is SAC's [-20, 2], so that
    both algorithms explore alike.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        for layer in self.latent_pi:
            if isinstance(layer, nn.ReLU):
                # The layer before it needs no output of its own for its gradient.
                layer.inplace = True

    def encode(self, obs: PyTorchObs) -> th.Tensor:
        """Features of observations, shape (B, features_dim)."""
        return encode(
            self.features_extractor,
            obs,
            self.observation_space,
            normalize_images=self.normalize_images,
        )

    def get_action_dist_params(
        self, obs: PyTorchObs
    ) -> tuple[th.Tensor, th.Tensor, dict[str, th.Tensor]]:
        """Mean, log deviation and further arguments of the action distribution."""
        return self.distribution_parameters(self.encode(obs))

    def distribution_parameters(
        self, features: th.Tensor
    ) -> tuple[th.Tensor, th.Tensor, dict[str, th.Tensor]]:
        """As `get_action_dist_params`, from features of shape (B, features_dim)."""
        latent = self.latent_pi(features)
        if self.use_sde:
            return self.mu(latent), self.log_std, {"latent_sde": latent}
        log_std = cast(nn.Linear, self.log_std)(latent).clamp(LOG_STD_MIN, LOG_STD_MAX)
        return self.mu(latent), log_std, {}

    def _mean_and_log_std(self, features: th.Tensor) -> tuple[th.Tensor, th.Tensor]:
        """As `distribution_parameters` without gSDE, both heads by one product.

        A product with so few columns costs as much as one with twice as many. Acting keeps one for
        each, since other rounding would give trained policies other actions.
        """
        mean, log_std = cast(nn.Linear, self.mu), cast(nn.Linear, self.log_std)
        weight = th.cat([mean.weight, log_std.weight])
        bias = th.cat([mean.bias, log_std.bias])
        heads = nn.functional.linear(self.latent_pi(features), weight, bias)
        means, log_stds = heads.chunk(2, dim=1)
        return means, log_stds.clamp(LOG_STD_MIN, LOG_STD_MAX)

    def sample(self, features: th.Tensor) -> tuple[th.Tensor, th.Tensor]:
        """Draw actions with the reparametrisation trick.

        Args:
            features: Encoded observations, shape (B, features_dim).

        Returns:
            Actions in [-1, 1] of shape (B, action_dim), and the logarithm of their density there,
            shape (B,).
        """
        if isinstance(self.action_dist, SquashedDiagGaussianDistribution):
            mean, log_std = self._mean_and_log_std(features)
            return squashed_sample(mean, log_std, th.randn_like(mean), self.action_dist.epsilon)
        mean, log_std, kwargs = self.distribution_parameters(features)
        return self.action_dist.log_prob_from_params(mean, log_std, **kwargs)

    def resample_noise(self) -> None:
        """Draw gSDE's exploration matrix anew; nothing to do without gSDE."""
        if isinstance(self.action_dist, StateDependentNoiseDistribution):
            self.reset_noise()
