"""What the policies of all algorithms share: actor, batched critics, target critics."""

from __future__ import annotations

from functools import cached_property
from types import MappingProxyType
from typing import Any, ClassVar, Final

import torch as th
from gymnasium import spaces
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.torch_layers import (
    BaseFeaturesExtractor,
    CombinedExtractor,
    FlattenExtractor,
    NatureCNN,
    get_actor_critic_arch,
)
from stable_baselines3.common.type_aliases import PyTorchObs, Schedule
from stable_baselines3.common.utils import get_parameters_by_name, polyak_update
from torch import nn

from sb3_bayes_dsac.common.actors import Actor
from sb3_bayes_dsac.common.critics import EnsembleCritics
from sb3_bayes_dsac.common.encoders import DepthEncoder, image_keys
from sb3_bayes_dsac.common.fused_adam import FusedAdam
from sb3_bayes_dsac.errors import ArgumentError, choose

# Which losses train a shared encoder: (the critics', the actor's).
ENCODER_GRADIENTS: Final = MappingProxyType(
    {"critic": (True, False), "actor": (False, True), "both": (True, True)}
)
# PyTorch's default loop over parameters is several times slower on a CPU than its fused kernel.
FUSED_OPTIMIZERS: Final = (th.optim.Adam, th.optim.AdamW)


def weights_and_statistics(*networks: nn.Module) -> tuple[list[nn.Parameter], list[th.Tensor]]:
    """All weights of some networks, each once, and their batch-norm statistics."""
    # One parent module visits weights that its children share only once.
    parent = nn.ModuleList(networks)
    return list(parent.parameters()), get_parameters_by_name(parent, ["running_"])


class EnsemblePolicy(BasePolicy):
    """Actor, n batched critics and their target.

    Arguments that are not listed are those of SB3's SAC policy.

    Args:
        features_extractor_class: Encoder; by default `default_encoder` chooses it.
        optimizer_class: Optimiser; by default Adam, with less overhead than PyTorch's own.
        optimizer_kwargs: Arguments of the optimiser; PyTorch's Adam and AdamW are fused unless it
            says otherwise.
        n_critics: Number of critics, at least 1; None means `default_n_critics`.
        share_features_extractor: Whether actor and critics share one encoder, as in the paper.
            SB3's default is False; here it is True, since one pass then serves all of them.
        encoder_gradient: Which loss trains a shared encoder: "critic" (default), "actor" (what
            SB3 does) or "both". The paper says "jointly trained" and not by what.
        layer_norm: Whether the critics normalise before each activation.

    Raises:
        ArgumentError: `n_critics` below 1, unknown `encoder_gradient`, or an `encoder_gradient`
            without a shared encoder.
    """

    critic_class: ClassVar[type[EnsembleCritics]]
    default_n_critics: ClassVar[int] = 2
    actor: Actor
    critic: EnsembleCritics
    critic_target: EnsembleCritics

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        action_space: spaces.Box,
        lr_schedule: Schedule,
        net_arch: list[int] | dict[str, list[int]] | None = None,
        activation_fn: type[nn.Module] = nn.ReLU,
        use_sde: bool = False,
        log_std_init: float = -3,
        use_expln: bool = False,
        clip_mean: float = 2.0,
        features_extractor_class: type[BaseFeaturesExtractor] | None = None,
        features_extractor_kwargs: dict[str, Any] | None = None,
        normalize_images: bool = True,
        optimizer_class: type[th.optim.Optimizer] = FusedAdam,
        optimizer_kwargs: dict[str, Any] | None = None,
        n_critics: int | None = None,
        share_features_extractor: bool = True,
        encoder_gradient: str | None = None,
        layer_norm: bool = False,
    ) -> None:
        if optimizer_class in FUSED_OPTIMIZERS:
            optimizer_kwargs = {"fused": True} | (optimizer_kwargs or {})
        super().__init__(
            observation_space,
            action_space,
            features_extractor_class or self.default_encoder(observation_space),
            features_extractor_kwargs,
            optimizer_class=optimizer_class,
            optimizer_kwargs=optimizer_kwargs,
            squash_output=True,
            normalize_images=normalize_images,
        )
        if encoder_gradient is not None and not share_features_extractor:
            cure = "only a shared encoder has a choice; leave it out or share_features_extractor"
            raise ArgumentError("encoder_gradient", encoder_gradient, cure)
        self.share_features_extractor = share_features_extractor
        self.encoder_gradient = encoder_gradient
        self.critic_trains_encoder, self.actor_trains_encoder = choose(
            "encoder_gradient", encoder_gradient or "critic", ENCODER_GRADIENTS
        )
        self.net_arch = [256, 256] if net_arch is None else net_arch
        actor_arch, critic_arch = get_actor_critic_arch(self.net_arch)
        shared_kwargs = {
            "observation_space": observation_space,
            "action_space": action_space,
            "activation_fn": activation_fn,
            "normalize_images": normalize_images,
        }
        self.actor_kwargs = {
            **shared_kwargs,
            "net_arch": actor_arch,
            "use_sde": use_sde,
            "log_std_init": log_std_init,
            "use_expln": use_expln,
            "clip_mean": clip_mean,
        }
        self.critic_kwargs = {
            **shared_kwargs,
            "net_arch": critic_arch,
            "n_critics": self.default_n_critics if n_critics is None else n_critics,
            "layer_norm": layer_norm,
        }
        self._build(lr_schedule)

    @classmethod
    def default_encoder(cls, observation_space: spaces.Space[Any]) -> type[BaseFeaturesExtractor]:
        """Encoder for these observations when the user names none."""
        return FlattenExtractor

    def _build(self, lr_schedule: Schedule) -> None:
        """Create networks and optimisers; targets start as copies and stay in eval mode."""
        share = self.share_features_extractor
        self.actor = self.make_actor()
        self.critic = self.make_critic(self.actor.features_extractor if share else None)
        self.critic_target = self.make_critic()
        self.critic_target.load_state_dict(self.critic.state_dict())
        self.critic_target.set_training_mode(False)
        # An encoder has one optimiser: the critics' if their loss reaches it, else the actor's.
        skip_in_actor = share and self.critic_trains_encoder
        skip_in_critic = share and not self.critic_trains_encoder
        self.actor.optimizer = self._make_optimizer(self.actor, skip_in_actor, lr_schedule)
        self.critic.optimizer = self._make_optimizer(self.critic, skip_in_critic, lr_schedule)

    def _make_optimizer(
        self, network: Actor | EnsembleCritics, skip_encoder: bool, lr_schedule: Schedule
    ) -> th.optim.Optimizer:
        """Optimiser of a network, with or without its encoder."""
        encoder = set(network.features_extractor.parameters()) if skip_encoder else set()
        parameters = [weight for weight in network.parameters() if weight not in encoder]
        options = {"lr": lr_schedule(1), **self.optimizer_kwargs}
        return self.optimizer_class(parameters, **options)

    def make_actor(self, features_extractor: BaseFeaturesExtractor | None = None) -> Actor:
        """A new actor, with an encoder of its own unless one is given."""
        kwargs = self._update_features_extractor(self.actor_kwargs, features_extractor)
        return Actor(**kwargs).to(self.device)

    def make_critic(
        self, features_extractor: BaseFeaturesExtractor | None = None
    ) -> EnsembleCritics:
        """New critics, with an encoder of their own unless one is given."""
        kwargs = self._update_features_extractor(self.critic_kwargs, features_extractor)
        return self.critic_class(**kwargs).to(self.device)

    def critic_features(self, features: th.Tensor) -> th.Tensor:
        """The online critics' features as their loss may use them, shape (B, features_dim)."""
        trains = self.critic_trains_encoder or not self.share_features_extractor
        return features if trains else features.detach()

    def actor_features(self, obs: PyTorchObs, features: th.Tensor) -> th.Tensor:
        """The online actor's features as its loss may use them.

        Args:
            obs: Batch of observations.
            features: What the online critics' encoder made of them, shape (B, features_dim).

        Returns:
            With a shared encoder the same numbers without another pass, shape (B, features_dim).
        """
        if not self.share_features_extractor:
            return self.actor.encode(obs)
        return features if self.actor_trains_encoder else features.detach()

    def next_features(self, obs: PyTorchObs) -> tuple[th.Tensor, th.Tensor]:
        """Features of the next observations for the actor of the target, and its critics."""
        return self.actor.encode(obs), self.critic_target.encode(obs)

    @property
    def averaged(self) -> list[tuple[nn.Module, nn.Module]]:
        """Online networks that have a target, each with its target."""
        return [(self.critic, self.critic_target)]

    @cached_property
    def _online(self) -> tuple[list[nn.Parameter], list[th.Tensor]]:
        """Weights, a shared encoder listed once, and batch-norm statistics."""
        return weights_and_statistics(*(online for online, _ in self.averaged))

    @cached_property
    def _target(self) -> tuple[list[nn.Parameter], list[th.Tensor]]:
        """The target networks' share of `_online`, in the same order."""
        return weights_and_statistics(*(target for _, target in self.averaged))

    def update_targets(self, tau: float) -> None:
        """Average all weights into the targets once, and copy batch-norm statistics.

        Args:
            tau: Share of the online weights, in [0, 1].
        """
        weights, statistics = self._online
        target_weights, target_statistics = self._target
        with th.no_grad():
            th._foreach_lerp_([*target_weights], [*weights], tau)
        polyak_update(statistics, target_statistics, 1.0)

    def forward(self, obs: PyTorchObs, deterministic: bool = False) -> th.Tensor:
        """Actions of the online actor in [-1, 1], shape (B, action_dim)."""
        return self._predict(obs, deterministic=deterministic)

    def _predict(self, observation: PyTorchObs, deterministic: bool = False) -> th.Tensor:
        """Actions of the online actor in [-1, 1], shape (B, action_dim)."""
        actions: th.Tensor = self.actor(observation, deterministic)
        return actions

    def reset_noise(self, batch_size: int = 1) -> None:
        """Draw gSDE's exploration matrix anew, one for each of `batch_size` environments."""
        self.actor.reset_noise(batch_size=batch_size)

    def set_training_mode(self, mode: bool) -> None:
        """Switch online networks to training or evaluation; targets stay in evaluation.

        SB3 asks for it three times an environment step, of which one changes nothing.
        """
        if mode != self.training:
            self.actor.set_training_mode(mode)
            self.critic.set_training_mode(mode)
            self.training = mode

    def _get_constructor_parameters(self) -> dict[str, Any]:
        """Everything that `__init__` needs to build this policy again."""
        actor_names = ("activation_fn", "use_sde", "log_std_init", "use_expln", "clip_mean")
        return {
            **super()._get_constructor_parameters(),
            **{name: self.actor_kwargs[name] for name in actor_names},
            **{name: self.critic_kwargs[name] for name in ("n_critics", "layer_norm")},
            "net_arch": self.net_arch,
            "lr_schedule": self._dummy_schedule,
            "features_extractor_class": self.features_extractor_class,
            "features_extractor_kwargs": self.features_extractor_kwargs,
            "optimizer_class": self.optimizer_class,
            "optimizer_kwargs": self.optimizer_kwargs,
            "share_features_extractor": self.share_features_extractor,
            "encoder_gradient": self.encoder_gradient,
        }


class ImageInput(EnsemblePolicy):
    """A policy for image observations."""

    @classmethod
    def default_encoder(cls, observation_space: spaces.Space[Any]) -> type[BaseFeaturesExtractor]:
        """SB3's `NatureCNN`."""
        return NatureCNN


class DictInput(EnsemblePolicy):
    """A policy for Dict observations."""

    @classmethod
    def default_encoder(cls, observation_space: spaces.Space[Any]) -> type[BaseFeaturesExtractor]:
        """`DepthEncoder` if there is an image, SB3's `CombinedExtractor` if there is none."""
        has_image = isinstance(observation_space, spaces.Dict) and image_keys(observation_space)
        return DepthEncoder if has_image else CombinedExtractor
