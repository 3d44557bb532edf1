"""NaN and infinity stop training and leave the weights as they were."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch as th
from stable_baselines3.common.buffers import ReplayBuffer

from sb3_bayes_dsac import DSACT, REDQ, BayesDSAC
from sb3_bayes_dsac.errors import NotFiniteError

MakeModel = Callable[..., Any]
Fill = Callable[[Any, int], None]


@pytest.mark.parametrize("cls", [BayesDSAC, DSACT, REDQ])
@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("rewards", np.nan),
        ("rewards", np.inf),
        ("observations", np.nan),
        ("next_observations", np.inf),
        ("actions", np.nan),
    ],
)
def test_batch_with_a_bad_number(
    make_model: MakeModel, fill: Fill, cls: type[Any], part: str, value: float
) -> None:
    model = make_model(cls)
    fill(model, 60)
    model.train(3, 32)
    state = model.get_parameters()
    before = copy.deepcopy(state)
    log_ent_coef = model.log_ent_coef.clone()
    getattr(model.replay_buffer, part)[:60] = value
    with pytest.raises(
        NotFiniteError, match=f"{part}, critic_loss.* not finite .* step 4"
    ) as caught:
        model.train(2, 32)
    assert isinstance(caught.value, ValueError)
    assert caught.value.what[0] == part
    for name, tensor in model.policy.state_dict().items():
        assert th.equal(tensor, before["policy"][name])
    assert th.equal(model.log_ent_coef, log_ent_coef)
    if cls is not REDQ:
        # It may have taken in the finite sigma of this batch.
        assert model.mean_std.isfinite().all()


def test_image_key_is_named(make_model: MakeModel, fill: Fill, depth_env: type[Any]) -> None:
    model = make_model(BayesDSAC, "MultiInputPolicy", depth_env())
    fill(model, 40)
    model.replay_buffer.observations["state"][:] = np.nan
    with pytest.raises(NotFiniteError, match=r"observations\['state'\], critic_loss"):
        model.train(1, 8)


def test_divergence_is_told_from_bad_data(make_model: MakeModel, fill: Fill) -> None:
    model = make_model()
    fill(model, 60)
    next(model.critic.parameters()).data.fill_(np.inf)
    with pytest.raises(NotFiniteError, match="The batch is finite, so training diverged"):
        model.train(1, 8)


def test_learning_stops(make_model: MakeModel) -> None:
    class Poisoned(ReplayBuffer):
        def add(self, *args: Any, **kwargs: Any) -> None:
            super().add(*args, **kwargs)
            self.rewards[self.pos - 1] = np.nan

    model = make_model(replay_buffer_class=Poisoned)
    with pytest.raises(NotFiniteError, match="rewards"):
        model.learn(100)
    assert all(weight.isfinite().all() for weight in model.policy.parameters())
