"""What sets REDQ apart: when it updates what, and its random subsets."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import gymnasium as gym
import pytest
import torch as th

from sb3_bayes_dsac import REDQ

MakeModel = Callable[..., Any]
Fill = Callable[[Any, int], None]


def test_defaults_are_those_of_the_paper() -> None:
    model = REDQ("MlpPolicy", gym.make("Pendulum-v1"), buffer_size=10)
    assert (model.critic.n_critics, model.subset_size) == (10, 2)
    assert (model.gradient_steps, model.policy_delay) == (20, 20)


@pytest.mark.parametrize(("delay", "expected"), [(20, [4]), (2, [0, 2, 4]), (1, [0, 1, 2, 3, 4])])
def test_actor_moves_in_the_last_step_and_targets_in_every_step(
    make_model: MakeModel, fill: Fill, delay: int, expected: list[int]
) -> None:
    model = make_model(REDQ, policy_delay=delay)
    fill(model, 60)
    steps = {"actor": [], "critic": []}
    targets: list[th.Tensor] = []

    def note(name: str) -> Callable[..., None]:
        return lambda *_: steps[name].append(model._n_updates - 1)

    for name in steps:
        getattr(model, name).optimizer.register_step_post_hook(note(name))
    weight = next(model.critic_target.parameters())
    model.critic.optimizer.register_step_post_hook(lambda *_: targets.append(weight.clone()))
    model.train(5, 8)
    assert steps == {"actor": expected, "critic": [0, 1, 2, 3, 4]}
    assert all(not th.equal(a, b) for a, b in pairwise(targets))


def test_subsets_are_random_and_all_critics_learn(make_model: MakeModel, fill: Fill) -> None:
    model = make_model(REDQ, policy_kwargs={"n_critics": 5})
    fill(model, 60)
    subsets: list[tuple[int, ...]] = []
    evaluate = model.critic_target.evaluate_subset

    def noting(features: th.Tensor, actions: th.Tensor, subset: th.Tensor) -> th.Tensor:
        subsets.append(tuple(subset.tolist()))
        return evaluate(features, actions, subset)

    model.critic_target.evaluate_subset = noting
    before = [weight.clone() for weight in model.critic.ensemble.parameters()]
    model.train(30, 8)
    assert all(len(set(subset)) == 2 for subset in subsets)
    assert {i for subset in subsets for i in subset} == set(range(5))
    assert len(set(map(frozenset, subsets))) > 5
    for old, new in zip(before, model.critic.ensemble.parameters(), strict=True):
        assert (old != new).flatten(1).any(dim=1).all()
