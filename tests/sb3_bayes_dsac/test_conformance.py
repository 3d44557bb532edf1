"""What SB3 asks of SAC and sb3-contrib of TQC beyond running: spaces, saving, callbacks."""

from __future__ import annotations

import copy
import random
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from gymnasium import spaces
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.callbacks import CheckpointCallback, EvalCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.envs import BitFlippingEnv, SimpleMultiObsEnv
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.noise import (
    NormalActionNoise,
    OrnsteinUhlenbeckActionNoise,
    VectorizedActionNoise,
)
from stable_baselines3.common.sb2_compat.rmsprop_tf_like import RMSpropTFLike
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize
from torch import nn

from sb3_bayes_dsac import DSACT, REDQ, BayesDSAC
from sb3_bayes_dsac.common.soft_actor_critic import SoftActorCritic

MakeModel = Callable[..., Any]

all_classes = pytest.mark.parametrize("cls", [BayesDSAC, DSACT, REDQ])


class Spaces(gym.Env[Any, Any]):
    """Random observations of any space, actions of any Box; episodes of 10 steps."""

    def __init__(self, observation: spaces.Space[Any], action: spaces.Box) -> None:
        self.observation_space, self.action_space = observation, action

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        self.steps = 0
        return self.observation_space.sample(), {}

    def step(self, action: Any) -> Any:
        assert self.action_space.contains(action)
        self.steps += 1
        return self.observation_space.sample(), 1.0, self.steps >= 10, False, {}


ONE = spaces.Box(-1, 1, (1,))


@all_classes
@pytest.mark.parametrize(
    ("observation", "action"),
    [
        (spaces.Discrete(4), ONE),
        (spaces.MultiDiscrete([3, 2]), ONE),
        (spaces.MultiBinary([2, 3]), ONE),
        (spaces.Box(-1, 1, (2,), np.float64), spaces.Box(-1, 1, (2,), np.float64)),
        (spaces.Box(-1, 1, (2, 3)), spaces.Box(np.array([-3, 0]), np.array([-1, 5]), (2,))),
        (spaces.Box(-1, 1, (2,)), spaces.Box(-1, 1, (2, 2))),
    ],
)
def test_spaces(
    make_model: MakeModel, cls: type[SoftActorCritic], observation: Any, action: spaces.Box
) -> None:
    env = Spaces(observation, action)
    model = make_model(cls, env=env, learning_starts=5).learn(12)
    chosen, _ = model.predict(observation.sample())
    assert chosen.shape == action.shape
    assert (chosen >= action.low).all()
    assert (chosen <= action.high).all()


@all_classes
@pytest.mark.parametrize("action", [spaces.Discrete(2), spaces.MultiDiscrete([2, 2])])
@pytest.mark.parametrize("error", [AssertionError, ValueError])
def test_other_actions_are_refused_as_sb3_and_as_python_do(
    make_model: MakeModel, cls: type[SoftActorCritic], action: Any, error: type[Exception]
) -> None:
    with pytest.raises(error, match="action_space"):
        make_model(cls, env=Spaces(spaces.Box(-1, 1, (2,)), action))


@all_classes
def test_dict_observations_of_several_environments(
    make_model: MakeModel, cls: type[SoftActorCritic]
) -> None:
    env = DummyVecEnv([lambda: SimpleMultiObsEnv(discrete_actions=False)] * 2)
    model = make_model(cls, "MultiInputPolicy", env, learning_starts=5, train_freq=2).learn(16)
    assert model._n_updates > 0


@all_classes
@pytest.mark.parametrize("make_noise", [NormalActionNoise, OrnsteinUhlenbeckActionNoise])
def test_action_noise_of_several_environments(
    make_model: MakeModel, cls: type[SoftActorCritic], make_noise: type[Any]
) -> None:
    noise = VectorizedActionNoise(make_noise(np.zeros(1), 0.1 * np.ones(1)), 2)
    env = make_vec_env("Pendulum-v1", n_envs=2)
    assert make_model(cls, env=env, action_noise=noise).learn(50)._n_updates > 0


@all_classes
@pytest.mark.parametrize(
    "policy_kwargs",
    [
        {"activation_fn": nn.Tanh, "net_arch": {"pi": [8], "qf": [8, 8]}},
        {"optimizer_class": RMSpropTFLike, "optimizer_kwargs": {"eps": 1e-5}},
        {"optimizer_class": th.optim.AdamW, "optimizer_kwargs": {"weight_decay": 1e-2}},
        {"activation_fn": nn.GELU, "layer_norm": True},
    ],
)
def test_policy_arguments(
    make_model: MakeModel, cls: type[SoftActorCritic], policy_kwargs: dict[str, Any]
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = make_model(cls, policy_kwargs=policy_kwargs).learn(45)
    assert all(weight.isfinite().all() for weight in model.policy.parameters())


@all_classes
def test_state_dependent_noise_with_expln_in_several_environments(
    make_model: MakeModel, cls: type[SoftActorCritic]
) -> None:
    env = make_vec_env("Pendulum-v1", n_envs=2)
    kwargs = {"use_expln": True, "log_std_init": -2, "clip_mean": 1.5}
    model = make_model(cls, env=env, use_sde=True, sde_sample_freq=4, policy_kwargs=kwargs)
    assert model.learn(50)._n_updates > 0


@all_classes
def test_hindsight_replay_of_normalised_rewards(
    make_model: MakeModel, cls: type[SoftActorCritic]
) -> None:
    env = VecNormalize(
        DummyVecEnv([lambda: BitFlippingEnv(n_bits=4, continuous=True)] * 2), norm_obs=False
    )
    model = make_model(cls, "MultiInputPolicy", env, replay_buffer_class=HerReplayBuffer)
    assert model.learn(60)._n_updates > 0


@all_classes
@pytest.mark.parametrize("share", [True, False])
def test_batch_norm_statistics(
    make_model: MakeModel, cls: type[SoftActorCritic], share: bool
) -> None:
    class Normed(BaseFeaturesExtractor):
        def __init__(self, space: spaces.Box) -> None:
            super().__init__(space, 3)
            self.norm = nn.BatchNorm1d(3)

        def forward(self, observations: th.Tensor) -> th.Tensor:
            features: th.Tensor = self.norm(observations)
            return features

    kwargs = {"features_extractor_class": Normed, "share_features_extractor": share}
    model = make_model(cls, policy_kwargs=kwargs, policy_delay=1).learn(60)
    online = model.critic.features_extractor.norm
    target = model.critic_target.features_extractor.norm
    assert online.running_mean.abs().max() > 0.0
    assert th.equal(online.running_mean, target.running_mean)
    before = online.running_mean.clone()
    model.predict(model.observation_space.sample())
    evaluate_policy(model, Monitor(gym.make("Pendulum-v1")), n_eval_episodes=1)
    assert th.equal(online.running_mean, before)


@all_classes
def test_callbacks_of_sb3(
    make_model: MakeModel, tmp_path: Path, cls: type[SoftActorCritic]
) -> None:
    evaluation = EvalCallback(
        make_vec_env("Pendulum-v1"),
        eval_freq=50,
        n_eval_episodes=1,
        best_model_save_path=str(tmp_path),
        verbose=0,
    )
    checkpoint = CheckpointCallback(50, str(tmp_path), save_replay_buffer=True)
    make_model(cls).learn(60, callback=[evaluation, checkpoint])
    names = {path.name for path in tmp_path.iterdir()}
    assert {"best_model.zip", "rl_model_50_steps.zip"} <= names
    assert "rl_model_replay_buffer_50_steps.pkl" in names
    assert cls.load(tmp_path / "best_model", device="cpu").num_timesteps == 50


@all_classes
def test_deterministic_actions_do_not_vary(
    make_model: MakeModel, cls: type[SoftActorCritic]
) -> None:
    model = make_model(cls)
    obs = np.ones((4, 3), np.float32)
    first, second = (model.predict(obs, deterministic=True)[0] for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert not np.array_equal(model.predict(obs)[0], model.predict(obs)[0])


@all_classes
def test_parameters_must_match_exactly(make_model: MakeModel, cls: type[SoftActorCritic]) -> None:
    model = make_model(cls)
    parameters = model.get_parameters()
    del parameters["policy"]
    with pytest.raises(ValueError, match="do not match"):
        model.set_parameters(parameters)
    model.set_parameters(parameters, exact_match=False)
    with pytest.raises(ValueError, match="unknown"):
        model.set_parameters({"unknown": {}}, exact_match=False)


@all_classes
def test_other_spaces_are_refused_at_loading(
    make_model: MakeModel, tmp_path: Path, cls: type[SoftActorCritic]
) -> None:
    make_model(cls).save(tmp_path / "model")
    with pytest.raises(ValueError, match="spaces do not match"):
        cls.load(tmp_path / "model", env=Spaces(spaces.Box(-1, 1, (2,)), ONE))


def random_states() -> tuple[Any, ...]:
    return random.getstate(), np.random.get_state(), th.get_rng_state()


def set_random_states(states: tuple[Any, ...]) -> None:
    random.setstate(states[0])
    np.random.set_state(states[1])
    th.set_rng_state(states[2])


def state(model: SoftActorCritic) -> list[th.Tensor]:
    """Weights, running statistics and the optimisers' moments."""
    dicts, names = model._get_torch_save_params()
    optimizers: Any = [model.get_parameters()[name] for name in dicts if "optimizer" in name]
    moments = [
        tensor
        for optimizer in optimizers
        for entry in optimizer["state"].values()
        for tensor in entry.values()
    ]
    return [*model.policy.state_dict().values(), *moments, *(getattr(model, n) for n in names)]


@all_classes
@pytest.mark.parametrize("use_sde", [False, True])
def test_a_continued_run_equals_a_straight_one(
    make_model: MakeModel, tmp_path: Path, cls: type[SoftActorCritic], use_sde: bool
) -> None:
    model = make_model(cls, use_sde=use_sde, gradient_steps=3).learn(70)
    model.save(tmp_path / "model")
    model.save_replay_buffer(tmp_path / "buffer")
    states, env = random_states(), copy.deepcopy(model.get_env())

    model.learn(40, reset_num_timesteps=False)

    loaded = cls.load(tmp_path / "model", env=env, device="cpu", force_reset=False)
    loaded.load_replay_buffer(tmp_path / "buffer")
    set_random_states(states)
    loaded.learn(40, reset_num_timesteps=False)
    assert loaded.num_timesteps == model.num_timesteps == 110
    pairs = list(zip(state(model), state(loaded), strict=True))
    assert all(th.equal(a, b) for a, b in pairs)
    assert len(pairs) > 20
