"""The optimiser against PyTorch's own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import torch as th
from torch.optim.optimizer import (
    register_optimizer_step_post_hook,
    register_optimizer_step_pre_hook,
)
from torch.utils.hooks import RemovableHandle

from sb3_bayes_dsac.common.fused_adam import FusedAdam

SHAPES = ((2, 5, 7), (2, 1, 7), (3,))


def weights() -> list[th.nn.Parameter]:
    th.manual_seed(0)
    return [th.nn.Parameter(th.randn(shape)) for shape in SHAPES]


def descend(optimizer: th.optim.Optimizer, seed: int, dead: int = 0) -> None:
    """A step with random gradients; the last weight has none in the first step.

    Args:
        optimizer: To step.
        seed: Of the gradients.
        dead: Rows of the first weight without gradient.
    """
    generator = th.Generator().manual_seed(seed)
    for weight in optimizer.param_groups[0]["params"]:
        weight.grad = th.randn(weight.shape, generator=generator)
    if seed == 0:
        optimizer.param_groups[0]["params"][-1].grad = None
    optimizer.param_groups[0]["params"][0].grad[:dead] = 0.0
    optimizer.step()


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"lr": 0.1, "betas": (0.5, 0.9), "eps": 1e-3},
        {"weight_decay": 0.1},
        {"weight_decay": 0.1, "decoupled_weight_decay": True},
        {"amsgrad": True, "maximize": True},
    ],
)
def test_weights_and_state_are_those_of_pytorch(options: dict[str, Any]) -> None:
    expected, actual = (
        th.optim.Adam(weights(), fused=True, **options),
        FusedAdam(weights(), **options),
    )
    for seed in range(5):
        descend(expected, seed)
        descend(actual, seed)
    pairs = zip(expected.param_groups[0]["params"], actual.param_groups[0]["params"], strict=True)
    for a, b in pairs:
        assert th.equal(a, b)
        assert expected.state[a].keys() == actual.state[b].keys()
        assert all(
            th.equal(expected.state[a][key], actual.state[b][key]) for key in actual.state[b]
        )


def has_subnormal_averages(optimizer: th.optim.Optimizer) -> bool:
    averages = [
        state[key] for state in optimizer.state.values() for key in ("exp_avg", "exp_avg_sq")
    ]
    smallest = th.finfo(th.float32).smallest_normal
    return any(bool(((x != 0.0) & (x.abs() < smallest)).any()) for x in averages)


def test_averages_without_gradients_become_zero_and_weights_stay_those_of_pytorch() -> None:
    optimizers = [th.optim.Adam(weights(), fused=True), FusedAdam(weights())]
    for optimizer in optimizers:
        descend(optimizer, 1)
        for seed in range(2, 1_500):
            descend(optimizer, seed, dead=1)
    expected, actual = (optimizer.param_groups[0]["params"] for optimizer in optimizers)
    assert all(th.equal(a, b) for a, b in zip(expected, actual, strict=True))
    assert [has_subnormal_averages(optimizer) for optimizer in optimizers] == [True, False]
    averages = optimizers[1].state[actual[0]]["exp_avg"]
    assert not averages[0].any()
    assert averages[1].all()


def test_state_moves_to_pytorchs_optimiser_and_back() -> None:
    own, other = FusedAdam(weights()), th.optim.Adam(weights(), fused=True)
    descend(own, 1)
    descend(other, 1)
    back = FusedAdam(other.param_groups[0]["params"])
    back.load_state_dict(other.state_dict())
    other = th.optim.Adam(own.param_groups[0]["params"], fused=True)
    other.load_state_dict(own.state_dict())
    descend(back, 2)
    descend(other, 2)
    pairs = zip(back.param_groups[0]["params"], other.param_groups[0]["params"], strict=True)
    assert all(th.equal(a, b) for a, b in pairs)


def test_hooks_and_closure_are_called_once() -> None:
    optimizer = FusedAdam(weights())
    calls: list[str] = []
    optimizer.register_step_pre_hook(lambda *_: calls.append("before"))
    optimizer.register_step_post_hook(lambda *_: calls.append("after"))
    first = optimizer.param_groups[0]["params"][0]
    old = first.detach().clone()

    def closure() -> None:
        calls.append("closure")
        first.square().sum().backward()

    optimizer.step(closure)
    assert calls == ["before", "closure", "after"]
    assert not th.equal(first, old)


@pytest.mark.parametrize(
    "register", [register_optimizer_step_pre_hook, register_optimizer_step_post_hook]
)
def test_hooks_of_all_optimisers_are_called(register: Callable[..., RemovableHandle]) -> None:
    calls: list[th.optim.Optimizer] = []
    handle = register(lambda optimizer, *_: calls.append(optimizer))
    optimizer = FusedAdam(weights())
    try:
        descend(optimizer, 1)
    finally:
        handle.remove()
    descend(optimizer, 2)
    assert calls == [optimizer]
