"""Policies of DSAC-T and Bayes-DSAC: Gaussian critics, and a target of the actor too."""

from __future__ import annotations

from typing import ClassVar

import torch as th
from stable_baselines3.common.type_aliases import PyTorchObs, Schedule
from torch import nn

from sb3_bayes_dsac.common.actors import Actor
from sb3_bayes_dsac.common.critics import EnsembleCritics, GaussianCritics
from sb3_bayes_dsac.common.policies import DictInput, EnsemblePolicy, ImageInput


class DSACPolicy(EnsemblePolicy):
    """Actor, n batched Gaussian critics, and target networks of both.

    Arguments are those of `EnsemblePolicy`.
    """

    critic_class: ClassVar[type[EnsembleCritics]] = GaussianCritics
    critic: GaussianCritics
    critic_target: GaussianCritics
    actor_target: Actor

    def _build(self, lr_schedule: Schedule) -> None:
        """Add the target actor, which shares an encoder with the target critics or has its own."""
        super()._build(lr_schedule)
        share = self.share_features_extractor
        self.actor_target = self.make_actor(
            self.critic_target.features_extractor if share else None
        )
        self.actor_target.load_state_dict(self.actor.state_dict())
        self.actor_target.set_training_mode(False)

    @property
    def averaged(self) -> list[tuple[nn.Module, nn.Module]]:
        """Online networks that have a target, each with its target."""
        return [(self.actor, self.actor_target), *super().averaged]

    def next_features(self, obs: PyTorchObs) -> tuple[th.Tensor, th.Tensor]:
        """Features for the target actor and the target critics; one pass if they share."""
        features = self.critic_target.encode(obs)
        if self.share_features_extractor:
            return features, features
        return self.actor_target.encode(obs), features


class CnnPolicy(ImageInput, DSACPolicy):
    """Policy for image observations."""


class MultiInputPolicy(DictInput, DSACPolicy):
    """Policy for Dict observations."""


MlpPolicy = DSACPolicy
