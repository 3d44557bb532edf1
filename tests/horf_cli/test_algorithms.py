import pytest
from horf_cli.algorithms import SettingError, catalogue
from horf_cli.config import TrainConfig
from horf_cli.environments import EnvSettings
from horf_cli.models import buffer_megabytes, new_model
from horf_cli.training_envs import training_envs

from horf_env.errors import UnknownNameError
from sb3_bayes_dsac.common.encoders import DepthEncoder

ALGORITHMS = ("bayes_dsac", "dsac_t", "sac", "td3", "redq", "tqc", "ppo")


ENV = EnvSettings(scene="room", action_layer="joint_velocity")


@pytest.fixture(scope="module")
def env():
    made = training_envs(TrainConfig(env=ENV))
    yield made
    made.close()


def config(algo, steps=64, **settings):
    return TrainConfig(algo=algo, env=ENV, steps=steps, seed=3, settings=settings)


def off_policy(**changes):
    return TrainConfig(algo="sac", **changes).arguments()


def test_the_promised_algorithms_are_there():
    assert set(catalogue().algorithms) == {*ALGORITHMS, "dagger"}


@pytest.mark.parametrize("algo", ALGORITHMS)
def test_same_encoder_and_nets_for_all(env, algo):
    settings = config(algo, batch_size=8)
    settings.check()
    model = new_model(settings, env)
    encoders = [m for m in model.policy.modules() if isinstance(m, DepthEncoder)]
    assert encoders
    assert {encoder.features_dim for encoder in encoders} == {32 + 7 + 9 + 3 + 6}
    assert model.policy.net_arch == [256, 256]
    assert model.seed == 3
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(settings.steps)
    assert any((p != q).any() for p, q in zip(before, model.policy.parameters(), strict=True))


def test_only_the_deterministic_policy_gets_action_noise(env):
    assert new_model(config("td3"), env).action_noise is not None
    assert new_model(config("sac"), env).action_noise is None


def test_short_runs_get_small_buffers_and_warm_ups():
    short, long = config("sac", 1000).arguments(), config("sac", 10**6).arguments()
    assert (short["buffer_size"], short["learning_starts"]) == (1000, 200)
    assert (long["buffer_size"], long["learning_starts"]) == (50_000, 2000)
    assert config("ppo", 300).arguments()["n_steps"] == 300
    assert config("sac", 1000, learning_starts=900).arguments()["learning_starts"] == 900


def test_buffer_stores_a_frame_once(env):
    model = new_model(config("sac", 1000), env)
    # One image of 48 x 64 bytes and a sixteenth to spare, where SB3's buffer stores ten.
    assert buffer_megabytes(model) == pytest.approx(1000 * 48 * 64 * 17 / 16 / 1e6, rel=0.1)
    assert buffer_megabytes(new_model(config("ppo"), env)) is None


@pytest.mark.parametrize(
    ("ratio", "n_envs", "updates", "steps"),
    [(None, 1, 1, 2), (20.0, 1, 20, 1), (0.5, 4, 2, 1), (0.3, 1, 3, 10), (1.0, 3, 3, 1)],
)
def test_replay_ratio_is_gradient_steps_an_environment_step(ratio, n_envs, updates, steps):
    found = off_policy(replay_ratio=ratio, n_envs=n_envs)
    assert (found["gradient_steps"], found["train_freq"]) == (updates, steps)


def test_rollouts_are_as_long_for_any_number_of_environments():
    for n_envs in (1, 2, 5):
        found = TrainConfig(algo="ppo", n_envs=n_envs).arguments()
        # Evaluations every 6000 steps fall on ends of rollouts.
        assert 6000 % (found["n_steps"] * n_envs) == 0


@pytest.mark.parametrize(
    ("algo", "changes", "named"),
    [
        ("ppo", {"replay_ratio": 2.0}, "replay_ratio"),
        ("sac", {"replay_ratio": 1e-9}, "replay_ratio"),
        ("sac", {"settings": {"gamma": 1.5}}, "gamma"),
        ("sac", {"settings": {"batch_size": "many"}}, "batch_size"),
        ("sac", {"settings": {"train_freq": 5}}, "replay_ratio"),
        ("sac", {"settings": {"device": "cuda"}}, "device"),
        ("sac", {"settings": {"tau": "fast"}}, "tau"),
        ("bayes_dsac", {"settings": {"policy_delay": 1.5}}, "policy_delay"),
    ],
)
def test_wrong_settings_are_refused_by_name(algo, changes, named):
    with pytest.raises(SettingError, match=named):
        TrainConfig(algo=algo, env=ENV, **changes).check()


@pytest.mark.parametrize("algo", ALGORITHMS)
def test_settings_are_looked_up_in_the_signature(algo):
    with pytest.raises(UnknownNameError, match="gamma"):
        config(algo, gama=0.9).check()
    config(algo, gamma=0.9).check()


def test_unknown_algorithm():
    with pytest.raises(UnknownNameError, match="dsac_t"):
        catalogue().algorithm("dsact")
