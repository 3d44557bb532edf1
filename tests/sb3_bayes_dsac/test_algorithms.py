"""What SB3 demands of every off-policy algorithm, for each class of the family."""

from __future__ import annotations

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
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.envs import BitFlippingEnv, FakeImageEnv, IdentityEnv
from stable_baselines3.common.logger import KVWriter, Logger
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.save_util import load_from_zip_file
from stable_baselines3.common.vec_env import VecNormalize

from sb3_bayes_dsac import DSACT, REDQ, BayesDSAC
from sb3_bayes_dsac.common.diagnostics import Diagnostics
from sb3_bayes_dsac.common.soft_actor_critic import SoftActorCritic
from sb3_bayes_dsac.errors import ArgumentError

MakeModel = Callable[..., Any]
Fill = Callable[[Any, int], None]

LOGGED = {
    "learning_rate",
    "n_updates",
    "ent_coef",
    "actor_loss",
    "critic_loss",
    "ent_coef_loss",
    "q_mean",
    "q_gap",
}
LOGGED_OF_GAUSSIANS = {
    "sigma_mean",
    "sigma_mean_1",
    "sigma_mean_2",
    "sigma_fused",
    "fusion_weight_entropy",
    "clipped_share",
}

CLASSES = [BayesDSAC, DSACT, REDQ]
all_classes = pytest.mark.parametrize("cls", CLASSES)


def state(model: SoftActorCritic) -> list[th.Tensor]:
    """All weights and running statistics of a model."""
    _, names = model._get_torch_save_params()
    return [*model.policy.state_dict().values(), *(getattr(model, name) for name in names)]


def same(a: SoftActorCritic, b: SoftActorCritic) -> bool:
    """Whether all weights and running statistics of two models are equal bit by bit."""
    return all(th.equal(x, y) for x, y in zip(state(a), state(b), strict=True))


@all_classes
@pytest.mark.parametrize(
    "kwargs",
    [
        {},
        {"ent_coef": 0.1, "policy_delay": 1},
        {"use_sde": True, "sde_sample_freq": 8, "use_sde_at_warmup": True},
        {"n_steps": 3},
        {"train_freq": (1, "episode"), "gradient_steps": 10, "policy_delay": 3},
        {"train_freq": 4, "gradient_steps": -1},
        {"action_noise": NormalActionNoise(np.zeros(1), 0.1 * np.ones(1))},
        {"learning_rate": lambda progress: 1e-3 * progress},
        {"policy_kwargs": {"n_critics": 1}},
        {"policy_kwargs": {"n_critics": 3, "layer_norm": True, "net_arch": [8]}},
        {"policy_kwargs": {"net_arch": {"pi": [], "qf": []}}},
        {
            "optimize_memory_usage": True,
            "replay_buffer_kwargs": {"handle_timeout_termination": False},
        },
    ],
    ids=lambda kwargs: "-".join(kwargs) or "default",
)
def test_runs_without_warnings(
    make_model: MakeModel, cls: type[SoftActorCritic], kwargs: dict[str, Any]
) -> None:
    if cls is REDQ and kwargs.get("policy_kwargs") == {"n_critics": 1}:
        kwargs = kwargs | {"subset_size": 1}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model = make_model(cls, **kwargs).learn(110)
    assert model._n_updates > 0
    assert all(th.isfinite(weight).all() for weight in model.policy.parameters())
    if isinstance(model, DSACT):
        assert (model.mean_std > 0).all()


@all_classes
@pytest.mark.parametrize("use_sde", [False, True])
def test_saved_model_predicts_and_continues_alike(
    make_model: MakeModel, tmp_path: Path, cls: type[SoftActorCritic], use_sde: bool
) -> None:
    kwargs: dict[str, Any] = {"policy_kwargs": {"n_critics": 3, "layer_norm": True}}
    own = {"subset_size": 3} if cls is REDQ else {"fusion": "log_pool"}
    model = make_model(cls, use_sde=use_sde, gradient_steps=1, **kwargs, **own).learn(120)
    model.save(tmp_path / "model")
    model.save_replay_buffer(tmp_path / "buffer")
    data, _, _ = load_from_zip_file(tmp_path / "model")
    # Networks are in the file once, as state dicts.
    assert data is not None
    assert {"policy", "actor", "actor_target", "critic", "critic_target"}.isdisjoint(data)
    loaded = cls.load(tmp_path / "model", env=gym.make("Pendulum-v1"), device="cpu")
    loaded.load_replay_buffer(tmp_path / "buffer")
    assert same(model, loaded)
    assert all(getattr(loaded, name) == value for name, value in own.items())
    assert loaded._n_updates == model._n_updates > 0
    obs = np.random.default_rng(0).normal(size=(10, 3)).astype(np.float32)
    expected, _ = model.predict(obs, deterministic=True)
    np.testing.assert_array_equal(loaded.predict(obs, deterministic=True)[0], expected)
    for each in (model, loaded):
        each.set_logger(model.logger)
        each.set_random_seed(3)
        each.train(6, 32)
    assert same(model, loaded)


def test_policy_alone_is_saved_and_loaded(make_model: MakeModel, tmp_path: Path) -> None:
    model = make_model()
    model.policy.save(str(tmp_path / "policy.pth"))
    loaded = type(model.policy).load(str(tmp_path / "policy.pth"), device="cpu")
    obs = np.zeros((1, 3), np.float32)
    expected, _ = model.predict(obs, deterministic=True)
    np.testing.assert_array_equal(loaded.predict(obs, deterministic=True)[0], expected)


def test_parameters_can_be_set_from_another_model(make_model: MakeModel) -> None:
    source, other = make_model(seed=1).learn(60), make_model(seed=2)
    parameters: Any = source.get_parameters()
    other.set_parameters(parameters)
    pairs = zip(source.policy.parameters(), other.policy.parameters(), strict=True)
    assert all(th.equal(a, b) for a, b in pairs)


@all_classes
def test_one_seed_gives_one_result(make_model: MakeModel, cls: type[SoftActorCritic]) -> None:
    first, second, other = (make_model(cls, seed=seed).learn(90) for seed in (7, 7, 8))
    assert same(first, second)
    assert not same(first, other)


@pytest.mark.parametrize("cls", [BayesDSAC, DSACT])
def test_classes_differ_in_their_rule_alone(make_model: MakeModel, cls: type[DSACT]) -> None:
    rule = {"fusion": "product"}
    assert same(make_model(cls, **rule).learn(80), make_model(BayesDSAC).learn(80))
    assert make_model(cls).fusion == {BayesDSAC: "product", DSACT: "min"}[cls]


@pytest.mark.parametrize("delay", [2, 3])
def test_delay_counts_gradient_steps_across_calls(
    make_model: MakeModel, fill: Fill, delay: int
) -> None:
    model = make_model(policy_delay=delay, policy_kwargs={"optimizer_class": th.optim.SGD})
    fill(model, 60)
    updates: list[str] = []
    for name in ("actor", "critic"):
        optimizer = getattr(model, name).optimizer
        optimizer.register_step_post_hook(lambda *_, name=name: updates.append(name))
    for gradient_steps in (1, 4, 2, 5):
        model.train(gradient_steps, 8)
    assert updates.count("critic") == model._n_updates == 12
    expected = [name for k in range(1, 13) for name in ["critic", "actor"][: 1 + (k % delay == 0)]]
    assert updates == expected


def test_gsde_noise_is_new_in_every_step_also_for_targets(
    make_model: MakeModel, fill: Fill
) -> None:
    model = make_model(use_sde=True)
    fill(model, 60)
    for actor in (model.actor, model.actor_target):
        before = actor.action_dist.exploration_mat.clone()
        model.train(1, 8)
        assert not th.equal(actor.action_dist.exploration_mat, before)


def test_many_steps_in_one_call_equal_many_calls(make_model: MakeModel, fill: Fill) -> None:
    models = make_model(), make_model()
    for model, calls in zip(models, ([6], [1, 2, 3]), strict=True):
        fill(model, 60)
        model.set_random_seed(0)
        for gradient_steps in calls:
            model.train(gradient_steps, 8)
    assert same(*models)


@all_classes
def test_logs_every_diagnostic(make_model: MakeModel, cls: type[SoftActorCritic]) -> None:
    model = make_model(cls, gradient_steps=4)
    model.learn(60, log_interval=1000)
    logged = model.logger.name_to_value
    expected = LOGGED | {f"q_mean_{i}" for i in range(1, model.critic.n_critics + 1)}
    if cls is not REDQ:
        expected |= LOGGED_OF_GAUSSIANS
    assert {name.removeprefix("train/") for name in logged if "train/" in name} == expected
    assert all(np.isfinite(value) for value in logged.values())
    assert logged["train/q_gap"] > 0.0
    if cls is REDQ:
        return
    entropy = logged["train/fusion_weight_entropy"]
    assert entropy == 0.0 if cls is DSACT else 0.0 < entropy <= np.log(2)
    if cls is BayesDSAC:
        assert logged["train/sigma_fused"] < logged["train/sigma_mean"]


@all_classes
def test_diagnostics_are_computed_when_somebody_looks(
    make_model: MakeModel, fill: Fill, monkeypatch: pytest.MonkeyPatch, cls: type[SoftActorCritic]
) -> None:
    model = make_model(cls, policy_delay=3)
    fill(model, 60)
    reads: list[int] = []
    read = Diagnostics.read

    def noting(diagnostics: Diagnostics) -> dict[str, float]:
        reads.append(model._n_updates)
        return read(diagnostics)

    monkeypatch.setattr(Diagnostics, "read", noting)
    for _ in range(4):
        model.train(1, 8)
    assert reads == []
    # The actor was updated one call earlier, and that is shown, too.
    logged = dict(model.logger.name_to_value)
    assert {"train/actor_loss", "train/critic_loss"} <= set(logged)
    assert reads == [4]
    # A second look shows the same.
    assert model.logger.name_to_value == logged


class Rows(KVWriter):
    """Keeps the names of everything that a logger writes."""

    def __init__(self) -> None:
        self.names: list[set[str]] = []

    def write(self, key_values: dict[str, Any], key_excluded: Any, step: int = 0) -> None:
        self.names.append(set(key_values))

    def close(self) -> None:
        pass


@all_classes
def test_every_row_of_the_log_has_the_diagnostics(
    make_model: MakeModel, cls: type[SoftActorCritic]
) -> None:
    rows = Rows()
    model = make_model(cls, train_freq=(1, "episode"), policy_delay=1)
    model.set_logger(Logger(None, [rows]))
    model.learn(600, log_interval=1)
    # The first episode (200 steps) ends before anything is learnt.
    assert [{"train/actor_loss", "train/critic_loss"} <= names for names in rows.names] == [
        False,
        True,
        True,
    ]


@all_classes
@pytest.mark.parametrize("share", [True, False])
def test_depth_observations(
    make_model: MakeModel,
    tmp_path: Path,
    depth_env: type[Any],
    cls: type[SoftActorCritic],
    share: bool,
) -> None:
    kwargs = {"policy_kwargs": {"share_features_extractor": share}}
    model = make_model(cls, "MultiInputPolicy", depth_env(), **kwargs).learn(80)
    model.save(tmp_path / "model")
    loaded = cls.load(tmp_path / "model", device="cpu")
    obs = depth_env().observation_space.sample()
    expected, _ = model.predict(obs, deterministic=True)
    np.testing.assert_array_equal(loaded.predict(obs, deterministic=True)[0], expected)


@all_classes
def test_images(make_model: MakeModel, cls: type[SoftActorCritic]) -> None:
    env = FakeImageEnv(screen_height=40, screen_width=40, discrete=False)
    model = make_model(cls, "CnnPolicy", env).learn(60)
    image = env.observation_space.sample()
    assert model.predict(image)[0].shape == env.action_space.shape


@all_classes
def test_hindsight_replay(make_model: MakeModel, cls: type[SoftActorCritic]) -> None:
    env = BitFlippingEnv(n_bits=4, continuous=True)
    model = make_model(
        cls,
        "MultiInputPolicy",
        env,
        replay_buffer_class=HerReplayBuffer,
        replay_buffer_kwargs={"n_sampled_goal": 2},
    )
    assert model.learn(90)._n_updates > 0


@all_classes
def test_normalised_and_several_environments(
    make_model: MakeModel, cls: type[SoftActorCritic]
) -> None:
    env = VecNormalize(make_vec_env("Pendulum-v1", n_envs=3))
    model = make_model(cls, env=env, gradient_steps=-1, train_freq=2).learn(180)
    # 30 rounds of 2 x 3 steps, the first six of them (40 steps) without training.
    assert model._n_updates == 24 * 6
    assert model._vec_normalize_env is env


def test_targets_are_normalised_rewards(make_model: MakeModel) -> None:
    env = VecNormalize(make_vec_env("Pendulum-v1"))
    model = make_model(env=env, gamma=0.0, learning_rate=1e-2).learn(250)
    # Raw rewards reach -16; normalised ones are of order one.
    assert abs(model.logger.name_to_value["train/q_mean"]) < 3.0


def test_compiled_policy_predicts_alike(make_model: MakeModel) -> None:
    model = make_model()
    obs = np.zeros((1, 3), np.float32)
    expected, _ = model.predict(obs, deterministic=True)
    compiled: Any = th.compile(model.policy, backend="eager")
    model.policy = compiled
    np.testing.assert_allclose(model.predict(obs, deterministic=True)[0], expected)
    model.learn(60)


def test_targets_stay_in_evaluation_mode(make_model: MakeModel, fill: Fill) -> None:
    model = make_model()
    fill(model, 20)
    model.train(2, 8)
    assert model.critic.training
    assert not model.critic_target.training
    model.predict(np.zeros((1, 3), np.float32))
    assert not model.actor.training
    assert not model.actor_target.training


def test_callbacks_see_every_step(make_model: MakeModel) -> None:
    class Count(BaseCallback):
        def _on_step(self) -> bool:
            return self.num_timesteps < 70

    assert make_model().learn(200, callback=Count()).num_timesteps == 70


def test_runs_are_named_after_their_class(make_model: MakeModel, tmp_path: Path) -> None:
    make_model(BayesDSAC, tensorboard_log=str(tmp_path)).learn(10)
    make_model(DSACT, tensorboard_log=str(tmp_path)).learn(10, tb_log_name="mine")
    assert {path.name for path in tmp_path.iterdir()} == {"BayesDSAC_1", "mine_1"}


class BoxAndDiscrete(gym.Env[Any, Any]):
    """An environment whose actions no Gaussian actor can take."""

    observation_space = spaces.Box(-1, 1, (2,))
    action_space = spaces.MultiBinary(2)


@pytest.mark.parametrize(
    ("kwargs", "message"),
    [
        ({"fusion": "prodct"}, "fusion='prodct': did you mean 'product'"),
        ({"fusion": "zzz"}, "'log_pool', 'min', 'product'"),
        ({"fusion": ["min"]}, r"fusion=\['min'\]: .*'log_pool', 'min', 'product'"),
        ({"policy_delay": 0}, "policy_delay=0: give a whole number, 1 or more"),
        ({"policy_delay": 1.5}, "policy_delay=1.5: give a whole number"),
        ({"batch_size": 0}, "batch_size=0"),
        ({"target_entropy": "automatic"}, "target_entropy='automatic': give \"auto\""),
        ({"target_entropy": None}, "target_entropy=None"),
        ({"policy_kwargs": {"n_critics": "2"}}, "n_critics='2': give a whole number"),
        ({"ent_coef": "automatic"}, "ent_coef='automatic'"),
        ({"env": IdentityEnv(2)}, "action_space=Discrete.*Box action space"),
        ({"env": BoxAndDiscrete()}, "action_space=MultiBinary.*Box action space"),
        ({"policy_kwargs": {"n_critics": 0}}, "n_critics=0"),
        ({"cls": REDQ, "subset_size": 11}, "subset_size=11: give 1 to n_critics, which is 10"),
        ({"cls": REDQ, "subset_size": 0}, "subset_size=0"),
        ({"cls": REDQ, "subset_size": 1.5}, "subset_size=1.5"),
        ({"cls": REDQ, "env": IdentityEnv(2)}, "action_space=Discrete"),
    ],
)
def test_bad_arguments_are_named_at_construction(
    make_model: MakeModel, kwargs: dict[str, Any], message: str
) -> None:
    with pytest.raises(ArgumentError, match=message) as caught:
        make_model(**kwargs)
    assert isinstance(caught.value, ValueError)
