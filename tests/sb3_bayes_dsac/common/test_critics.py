from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch as th
from gymnasium import spaces
from stable_baselines3.common.torch_layers import FlattenExtractor
from torch import nn

from sb3_bayes_dsac.common.critics import GaussianCritics
from sb3_bayes_dsac.common.ensemble import EnsembleHeads, EnsembleLinear
from sb3_bayes_dsac.errors import ArgumentError

OBS = spaces.Box(-1, 1, (5,))
ACTION = spaces.Box(-1, 1, (2,))


def make(
    n_critics: int = 3, layer_norm: bool = False, net_arch: tuple[int, ...] = (8, 6)
) -> GaussianCritics:
    return GaussianCritics(
        OBS,
        ACTION,
        [*net_arch],
        FlattenExtractor(OBS),
        5,
        n_critics=n_critics,
        layer_norm=layer_norm,
    )


def one_by_one(critics: GaussianCritics, i: int) -> nn.Sequential:
    """Critic i as a plain perceptron of torch layers with the same weights."""
    state = critics.ensemble.state_dict()
    layers: list[nn.Module] = []
    for k, module in enumerate(critics.ensemble):
        if f"{k}.weight" not in state:
            layers.append(module)
            continue
        weight, bias = state[f"{k}.weight"][i], state[f"{k}.bias"][i].flatten()
        if isinstance(module, EnsembleLinear):
            layer: nn.Module = nn.Linear(*weight.shape)
            layer.load_state_dict({"weight": weight.T, "bias": bias})
        elif isinstance(module, EnsembleHeads):
            layer = nn.Linear(*weight.T.shape)
            layer.load_state_dict({"weight": weight, "bias": bias})
        else:
            layer = nn.LayerNorm(len(bias))
            layer.load_state_dict({"weight": weight[0], "bias": bias})
        layers.append(layer)
    return nn.Sequential(*layers)


@pytest.mark.parametrize("layer_norm", [False, True])
@pytest.mark.parametrize("n_critics", [1, 2, 5])
def test_batched_critics_equal_separate_networks(n_critics: int, layer_norm: bool) -> None:
    th.manual_seed(0)
    critics = make(n_critics, layer_norm)
    for parameter in critics.parameters():
        nn.init.normal_(parameter)
    obs, actions = th.randn(7, 5), th.randn(7, 2)
    means, stds = critics(obs, actions)
    assert means.shape == stds.shape == (n_critics, 7)
    for i in range(n_critics):
        head = one_by_one(critics, i)(th.cat([obs, actions], dim=1))
        th.testing.assert_close(means[i], head[:, 0])
        th.testing.assert_close(stds[i], nn.functional.softplus(head[:, 1]))


@pytest.mark.parametrize("layer", [EnsembleLinear, EnsembleHeads])
def test_weights_start_as_torch_draws_them(layer: type[EnsembleLinear | EnsembleHeads]) -> None:
    th.manual_seed(0)
    ours = layer(4, 100, 200)
    theirs = nn.Linear(100, 200)
    quantiles = np.linspace(0.0, 1.0, 11)
    for a, b in ((ours.weight, theirs.weight), (ours.bias, theirs.bias)):
        drawn, expected = (p.detach().numpy().ravel() for p in (a, b))
        np.testing.assert_allclose(
            np.quantile(drawn, quantiles), np.quantile(expected, quantiles), atol=0.02
        )
    assert not th.equal(ours.weight[0], ours.weight[1])


@pytest.mark.parametrize("options", [{}, {"layer_norm": True}, {"net_arch": ()}])
def test_frozen_critics_pass_the_gradient_to_actions_alone(options: dict[str, Any]) -> None:
    th.manual_seed(0)
    critics = make(**options)
    features = th.randn(4, 5)
    results = []
    for frozen in (False, True):
        actions = th.ones(4, 2, requires_grad=True)
        means, stds = critics.evaluate(features, actions, frozen=frozen)
        critics.zero_grad()
        th.autograd.backward((means * stds).sum())
        assert actions.grad is not None
        results.append((means, stds, actions.grad))
        assert all((weight.grad is None) == frozen for weight in critics.parameters())
    th.testing.assert_close(*results)


@pytest.mark.parametrize("out_features", [1, 2, 3])
def test_gradients_of_heads_are_those_of_the_product(out_features: int) -> None:
    th.manual_seed(0)
    heads = EnsembleHeads(3, 5, out_features).double()
    x = th.randn(3, 4, 5, dtype=th.float64, requires_grad=True)
    plain = (heads.weight @ x.transpose(1, 2)) + heads.bias
    th.testing.assert_close(heads(x), plain)
    weights = th.randn_like(plain)
    leaves = (x, heads.weight, heads.bias)
    ours = th.autograd.grad((heads(x) * weights).sum(), leaves)
    theirs = th.autograd.grad((plain * weights).sum(), leaves)
    for a, b in zip(ours, theirs, strict=True):
        th.testing.assert_close(a, b)


@pytest.mark.parametrize("n_critics", [0, -1])
def test_there_must_be_a_critic(n_critics: int) -> None:
    with pytest.raises(
        ArgumentError, match=f"n_critics={n_critics}: give a whole number, 1 or more"
    ):
        make(n_critics)
