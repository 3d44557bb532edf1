"""`compile_updates`: the same learning from a compiled graph."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch as th

from sb3_bayes_dsac import REDQ, BayesDSAC
from sb3_bayes_dsac.common.compiled import Compiled
from sb3_bayes_dsac.common.soft_actor_critic import SoftActorCritic
from sb3_bayes_dsac.errors import ArgumentError
from tests.sb3_bayes_dsac.test_algorithms import Fill, MakeModel, state


def trained(make_model: MakeModel, cls: type[SoftActorCritic], **kwargs: Any) -> Any:
    """A model after some dozen updates on Pendulum."""
    return make_model(cls, seed=0, learning_starts=20, **kwargs).learn(60)


@pytest.mark.parametrize("cls", [BayesDSAC, REDQ])
def test_learns_the_same_but_for_rounding(
    make_model: MakeModel, tmp_path: Path, cls: type[SoftActorCritic]
) -> None:
    plain = trained(make_model, cls, gradient_steps=2, policy_delay=2)
    model = trained(make_model, cls, gradient_steps=2, policy_delay=2, compile_updates=True)
    assert model._n_updates == plain._n_updates > 30
    for ours, reference in zip(state(model), state(plain), strict=True):
        th.testing.assert_close(ours, reference, rtol=1e-4, atol=1e-5)
    logged, expected = model.logger.name_to_value, plain.logger.name_to_value
    assert set(logged) == set(expected)
    for name in {name for name in logged if name.startswith("train/")}:
        assert logged[name] == pytest.approx(expected[name], rel=1e-3, abs=1e-4), name

    model.save(tmp_path / "model")
    loaded = cls.load(tmp_path / "model", device="cpu")
    assert loaded.compile_updates
    assert all(th.equal(x, y) for x, y in zip(state(loaded), state(model), strict=True))


def test_each_kind_of_step_and_size_of_batch_has_its_graph(
    make_model: MakeModel, fill: Fill
) -> None:
    model = make_model(BayesDSAC, compile_updates=True)
    fill(model, 60)
    small, large = (model.replay_buffer.sample(n) for n in (8, 16))
    graph = model._differentiation(small, update_actor=True)
    assert isinstance(graph, Compiled)
    assert model._differentiation(model.replay_buffer.sample(8), update_actor=True) is graph
    assert model._differentiation(large, update_actor=True) is not graph
    assert model._differentiation(small, update_actor=False) is not graph


def test_the_first_call_counts_once(make_model: MakeModel, fill: Fill) -> None:
    """Recording moves statistics and draws noise as a call without recording does."""
    plain, model = (make_model(BayesDSAC, seed=0, compile_updates=c) for c in (False, True))
    for each in (plain, model):
        fill(each, 60)
        np.random.seed(0)
        th.manual_seed(0)
        each.train(1, 8)
    assert all(th.equal(x, y) for x, y in zip(state(model), state(plain), strict=True))


def test_weights_are_those_of_the_moment(make_model: MakeModel, fill: Fill) -> None:
    """Also when their memory is another one, as after `policy.to` another device."""
    plain, model = (make_model(BayesDSAC, seed=0, compile_updates=c) for c in (False, True))
    for each in (plain, model):
        fill(each, 60)
        np.random.seed(0)
        th.manual_seed(0)
        each.train(4, 8)
        for weight in each.policy.parameters():
            weight.data = weight.data / 2
        each.train(4, 8)
    for ours, reference in zip(state(model), state(plain), strict=True):
        th.testing.assert_close(ours, reference, rtol=1e-4, atol=1e-5)


def test_gsde_is_refused(make_model: MakeModel) -> None:
    with pytest.raises(ArgumentError, match=r"compile_updates=True: gSDE"):
        make_model(BayesDSAC, compile_updates=True, use_sde=True)


def test_a_missing_compiler_is_named(
    make_model: MakeModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(ArgumentError, match=r"no no-such-compiler; install a C\+\+ compiler"):
        make_model(BayesDSAC, compile_updates=True)
