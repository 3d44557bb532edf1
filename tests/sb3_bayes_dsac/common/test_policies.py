"""Sharing of the encoder, who trains it, target averaging, and rebuilding of policies."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch as th
from gymnasium import spaces
from stable_baselines3.common.torch_layers import (
    BaseFeaturesExtractor,
    CombinedExtractor,
    FlattenExtractor,
    NatureCNN,
)
from torch import nn

from sb3_bayes_dsac import DSACT
from sb3_bayes_dsac.common.encoders import DepthEncoder
from sb3_bayes_dsac.dsac_t.policies import CnnPolicy, DSACPolicy, MultiInputPolicy
from sb3_bayes_dsac.errors import ArgumentError

MakeModel = Callable[..., DSACT]
Fill = Callable[[DSACT, int], None]
Weights = dict[str, th.Tensor]


class BatchNormEncoder(BaseFeaturesExtractor):
    """A linear encoder with running statistics."""

    def __init__(self, observation_space: spaces.Box) -> None:
        super().__init__(observation_space, 6)
        self.layers = nn.Sequential(nn.Linear(observation_space.shape[0], 6), nn.BatchNorm1d(6))

    def forward(self, observations: th.Tensor) -> th.Tensor:
        features: th.Tensor = self.layers(observations)
        return features


def weights(module: nn.Module) -> Weights:
    return {name: value.clone() for name, value in module.state_dict().items()}


def changed(before: Weights, module: nn.Module) -> bool:
    return any(not th.equal(value, before[name]) for name, value in module.state_dict().items())


@pytest.fixture
def shared(make_model: MakeModel, fill: Fill, depth_env: type[Any]) -> MakeModel:
    """Model on depth images with a filled buffer; keywords go to the policy."""

    def make(policy_delay: int = 2, **policy_kwargs: Any) -> DSACT:
        model = make_model(
            policy="MultiInputPolicy",
            env=depth_env(),
            policy_kwargs=policy_kwargs,
            policy_delay=policy_delay,
        )
        fill(model, 40)
        return model

    return make


def count_passes(module: nn.Module) -> list[int]:
    passes: list[int] = []
    module.register_forward_hook(lambda *_: passes.append(1))
    return passes


@pytest.mark.parametrize("gradient", ["critic", "actor", "both"])
def test_one_encoder_pass_serves_all(shared: MakeModel, gradient: str) -> None:
    model = shared(policy_delay=1, encoder_gradient=gradient, n_critics=3)
    assert model.actor.features_extractor is model.critic.features_extractor
    assert model.actor_target.features_extractor is model.critic_target.features_extractor
    assert model.actor.features_extractor is not model.actor_target.features_extractor
    online = count_passes(model.actor.features_extractor)
    target = count_passes(model.actor_target.features_extractor)
    model.train(4, batch_size=16)
    assert (len(online), len(target)) == (4, 4)


@pytest.mark.parametrize(
    ("gradient", "after_critic_step", "after_actor_step"),
    [("critic", True, True), ("both", True, True), ("actor", False, True), (None, True, True)],
)
def test_encoder_moves_in_the_steps_that_train_it(
    shared: MakeModel, gradient: str | None, after_critic_step: bool, after_actor_step: bool
) -> None:
    model = shared(policy_delay=2, encoder_gradient=gradient)
    encoder = model.critic.features_extractor
    before = weights(encoder)
    model.train(1, batch_size=16)
    assert changed(before, encoder) == after_critic_step
    before = weights(encoder)
    model.train(1, batch_size=16)
    assert changed(before, encoder) == after_actor_step


@pytest.mark.parametrize(
    "policy_kwargs",
    [{"encoder_gradient": name} for name in ("critic", "actor", "both")]
    + [{"share_features_extractor": False}],
)
def test_every_weight_has_one_optimiser(shared: MakeModel, policy_kwargs: dict[str, Any]) -> None:
    model = shared(**policy_kwargs)
    optimised = [
        weight
        for network in (model.actor, model.critic)
        for group in network.optimizer.param_groups
        for weight in group["params"]
    ]
    online = {*model.actor.parameters(), *model.critic.parameters()}
    assert len(optimised) == len(online)
    assert set(optimised) == online


def encoder_gradients(model: DSACT) -> list[th.Tensor]:
    """Gradient that one full step leaves in the encoder, for one fixed batch and noise."""
    assert model.replay_buffer is not None
    np.random.seed(0)
    batch = model.replay_buffer.sample(16)
    model.replay_buffer.sample = lambda *_, **__: batch  # type: ignore[method-assign]
    th.manual_seed(0)
    model.train(1)
    gradients = []
    for parameter in model.critic.features_extractor.parameters():
        assert parameter.grad is not None
        gradients.append(parameter.grad)
    return gradients


def test_both_is_the_sum_of_the_two_gradients(shared: MakeModel) -> None:
    by = {
        gradient: encoder_gradients(shared(policy_delay=1, encoder_gradient=gradient))
        for gradient in ("critic", "actor", "both")
    }
    for critic, actor, both in zip(*(by[g] for g in ("critic", "actor", "both")), strict=True):
        th.testing.assert_close(critic + actor, both)
        assert not th.allclose(critic, both)


def test_separate_encoders_learn_from_their_own_loss(shared: MakeModel) -> None:
    model = shared(policy_delay=2, share_features_extractor=False)
    actor, critic = model.actor.features_extractor, model.critic.features_extractor
    assert actor is not critic
    actor_before, critic_before = weights(actor), weights(critic)
    model.train(1, batch_size=16)
    assert changed(critic_before, critic)
    assert not changed(actor_before, actor)
    model.train(1, batch_size=16)
    assert changed(actor_before, actor)


@pytest.mark.parametrize("share", [True, False])
def test_targets_start_as_copies(shared: MakeModel, share: bool) -> None:
    policy = shared(share_features_extractor=share).policy
    assert not changed(weights(policy.actor), policy.actor_target)
    assert not changed(weights(policy.critic), policy.critic_target)


@pytest.mark.parametrize("share", [True, False])
def test_targets_are_averaged_exactly_once(shared: MakeModel, share: bool) -> None:
    policy = shared(share_features_extractor=share).policy
    for parameter in policy.parameters():
        nn.init.normal_(parameter)
    pairs = ((policy.actor, policy.actor_target), (policy.critic, policy.critic_target))
    old = [weights(target) for _, target in pairs]
    policy.update_targets(0.25)
    for (online, target), before in zip(pairs, old, strict=True):
        for name, value in target.state_dict().items():
            expected = 0.75 * before[name] + 0.25 * online.state_dict()[name]
            th.testing.assert_close(value, expected)


@pytest.mark.parametrize("share", [True, False])
def test_batch_norm_statistics_reach_both_targets(
    make_model: MakeModel, fill: Fill, share: bool
) -> None:
    policy_kwargs = {
        "features_extractor_class": BatchNormEncoder,
        "share_features_extractor": share,
    }
    model = make_model(policy_kwargs=policy_kwargs)
    fill(model, 40)
    model.train(2, batch_size=16)
    for online, target in (
        (model.actor, model.actor_target),
        (model.critic, model.critic_target),
    ):
        statistics, target_statistics = (
            network.state_dict()["features_extractor.layers.1.running_mean"]
            for network in (online, target)
        )
        assert statistics.abs().max() > 0.0
        th.testing.assert_close(target_statistics, statistics)
        assert not target.training


@pytest.mark.parametrize(
    ("policy", "space", "expected"),
    [
        (DSACPolicy, spaces.Box(-1, 1, (3,)), FlattenExtractor),
        (CnnPolicy, spaces.Box(0, 255, (3, 36, 36), np.uint8), NatureCNN),
        (MultiInputPolicy, spaces.Dict({"a": spaces.Box(-1, 1, (3,))}), CombinedExtractor),
        (
            MultiInputPolicy,
            spaces.Dict({"a": spaces.Box(0, 255, (5, 24, 32), np.uint8)}),
            DepthEncoder,
        ),
    ],
)
def test_default_encoders(
    policy: type[DSACPolicy], space: spaces.Space[Any], expected: type[BaseFeaturesExtractor]
) -> None:
    built = policy(space, spaces.Box(-1, 1, (2,)), lambda _: 1e-3)
    assert type(built.critic.features_extractor) is expected


CONSTRUCTOR_KWARGS: dict[str, Any] = {
    "net_arch": {"pi": [8], "qf": [9, 7]},
    "activation_fn": nn.GELU,
    "use_sde": True,
    "log_std_init": -2.0,
    "use_expln": True,
    "clip_mean": 1.5,
    "features_extractor_class": DepthEncoder,
    "features_extractor_kwargs": {"features_dim": 5},
    "normalize_images": False,
    "optimizer_class": th.optim.AdamW,
    "optimizer_kwargs": {"weight_decay": 0.1, "fused": False},
    "n_critics": 3,
    "share_features_extractor": True,
    "encoder_gradient": "both",
    "layer_norm": True,
}


def test_a_saved_policy_is_built_again_with_every_argument(
    tmp_path: Path, depth_env: type[Any]
) -> None:
    env = depth_env()
    policy = MultiInputPolicy(
        env.observation_space, env.action_space, lambda _: 1e-3, **CONSTRUCTOR_KWARGS
    )
    parameters = policy._get_constructor_parameters()
    assert {name: parameters[name] for name in CONSTRUCTOR_KWARGS} == CONSTRUCTOR_KWARGS
    policy.save(str(tmp_path / "policy.pth"))
    loaded = MultiInputPolicy.load(str(tmp_path / "policy.pth"), device="cpu")
    obs = env.observation_space.sample()
    expected, _ = policy.predict(obs, deterministic=True)
    np.testing.assert_array_equal(loaded.predict(obs, deterministic=True)[0], expected)
    assert loaded._get_constructor_parameters().keys() == parameters.keys()


def test_adam_is_fused_unless_told_otherwise(make_model: MakeModel) -> None:
    assert make_model().critic.optimizer.defaults["fused"] is True
    adam = {"optimizer_class": th.optim.Adam}
    assert make_model(policy_kwargs=adam).critic.optimizer.defaults["fused"] is True
    options = {"fused": False, "eps": 1e-5}
    plain = make_model(policy_kwargs=adam | {"optimizer_kwargs": options})
    assert plain.critic.optimizer.defaults["fused"] is False
    assert plain.critic.optimizer.defaults["eps"] == 1e-5
    assert make_model(policy_kwargs={"optimizer_class": th.optim.SGD}).critic.optimizer.defaults


@pytest.mark.parametrize(
    ("policy_kwargs", "message"),
    [
        (
            {"share_features_extractor": False, "encoder_gradient": "both"},
            "encoder_gradient='both': only a shared encoder",
        ),
        ({"encoder_gradient": "critics"}, "did you mean 'critic'"),
        ({"n_critics": 0}, "n_critics=0: give a whole number, 1 or more"),
    ],
)
def test_bad_arguments_are_named(
    make_model: MakeModel, policy_kwargs: dict[str, Any], message: str
) -> None:
    with pytest.raises(ArgumentError, match=message):
        make_model(policy_kwargs=policy_kwargs)
