from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from gymnasium import spaces
from sb3_contrib import TQC
from stable_baselines3 import SAC, TD3
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

from sb3_bayes_dsac import DSACT, REDQ, BayesDSAC
from sb3_bayes_dsac.common.q_bias import estimate_q_bias, soft_returns
from sb3_bayes_dsac.errors import ArgumentError

GAMMA = 0.9


class Countdown(gym.Env[np.ndarray, np.ndarray]):
    """Reward one a step; ends after `length` steps, in a terminal state or by time-out."""

    observation_space = spaces.Box(-1, 1, (2,))
    action_space = spaces.Box(-2, 2, (1,))

    def __init__(self, length: int = 5, *, terminal: bool = True) -> None:
        self.length, self.terminal = length, terminal

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        self.left = self.length
        return np.zeros(2, np.float32), {}

    def step(self, action: np.ndarray) -> Any:
        self.left -= 1
        over = self.left == 0
        return np.zeros(2, np.float32), 1.0, over and self.terminal, over and not self.terminal, {}


def model_of(cls: type[Any], env: Any = None, **kwargs: Any) -> Any:
    policy_kwargs = {"net_arch": [8]}
    return cls(
        "MlpPolicy",
        env or Countdown(),
        gamma=GAMMA,
        buffer_size=10,
        policy_kwargs=policy_kwargs,
        seed=0,
        **kwargs,
    )


def predict_always(model: Any, value: float) -> None:
    """Let all of a model's critics say one mean, whatever they see."""
    for weight in model.critic.parameters():
        weight.data.zero_()
    if hasattr(model.critic, "ensemble"):
        # The first head is the mean; the raw deviation stays 0.
        model.critic.ensemble[-1].bias.data[:, 0] = value
    else:
        for network in model.critic.q_networks:
            network[-1].bias.data.fill_(value)


@pytest.mark.parametrize("cls", [BayesDSAC, DSACT, REDQ, SAC, TQC, TD3])
def test_bias_is_prediction_minus_discounted_return(cls: type[Any]) -> None:
    model = model_of(cls, **({} if cls is TD3 else {"ent_coef": 0.0}))
    predict_always(model, 7.0)
    bias = estimate_q_bias(model, Countdown(), n_episodes=3)
    returns = np.array([sum(GAMMA**i for i in range(k)) for k in (5, 4, 3, 2, 1)])
    assert bias.n_pairs == 15
    assert bias.q_mean == pytest.approx(7.0)
    assert bias.mean == pytest.approx(7.0 - returns.mean())
    assert bias.std == pytest.approx(returns.std())
    assert bias.normalized_mean == pytest.approx(bias.mean / returns.mean())
    assert bias.normalized_std == pytest.approx(bias.std / returns.mean())
    assert bias.return_mean == pytest.approx(returns.mean())
    if issubclass(cls, DSACT):
        assert bias.sigma_mean == pytest.approx(np.log(2))
    else:
        assert bias.sigma_mean is None


@pytest.mark.parametrize("cls", [BayesDSAC, REDQ, SAC, TQC])
@pytest.mark.parametrize("ent_coef", [0.5, "auto_0.5"])
def test_later_entropy_is_part_of_the_return(
    cls: type[Any], ent_coef: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = model_of(cls, ent_coef=ent_coef)
    action = th.zeros(1, 1)
    monkeypatch.setattr(model.actor, "action_log_prob", lambda _: (action, th.tensor([-3.0])))
    bias = estimate_q_bias(model, Countdown(2), n_episodes=1)
    # First step: 1 + 0.9 (0.5 x 3 + 1); last step: 1.
    assert bias.return_mean == pytest.approx((1 + 0.9 * 2.5 + 1) / 2)


def test_soft_returns_leave_out_the_first_entropy() -> None:
    returns = soft_returns(np.array([1.0, 2.0, 4.0]), np.array([9.0, 10.0, 100.0]), 0.5)
    assert returns.tolist() == [1 + 0.5 * (10 + 2 + 0.5 * 104), 2 + 0.5 * 104, 4.0]


def test_pairs_shortly_before_a_time_out_do_not_count() -> None:
    model = model_of(SAC)
    env = Countdown(30, terminal=False)
    # 0.9^k <= 0.05 from k = 29 on: the pairs 30 and 29 steps before the time-out.
    assert estimate_q_bias(model, env, n_episodes=2).n_pairs == 4
    assert estimate_q_bias(model, env, n_episodes=2, tail=0.5).n_pairs == 2 * 24
    with pytest.raises(ArgumentError, match="time-outs hide all returns"):
        estimate_q_bias(model, Countdown(28, terminal=False))


def test_statistics_of_vec_normalize_apply() -> None:
    env = VecNormalize(make_vec_env(Countdown))
    model = model_of(SAC, env, ent_coef=0.0)
    env.ret_rms.var = np.array(4.0)
    bias = estimate_q_bias(model, Countdown(1), n_episodes=1)
    assert bias.return_mean == pytest.approx(0.5, rel=1e-4)


@pytest.mark.parametrize("cls", [BayesDSAC, REDQ])
def test_dict_observations(cls: type[Any], depth_env: Callable[[], Any]) -> None:
    model = cls("MultiInputPolicy", depth_env(), buffer_size=10, gamma=0.5, seed=0)
    # Time-out after 20 steps; 0.5^5 <= 0.05 leaves 16 of them.
    assert estimate_q_bias(model, depth_env(), n_episodes=1).n_pairs == 16
