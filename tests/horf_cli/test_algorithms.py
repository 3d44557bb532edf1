import pytest
from horf_cli.algorithms import catalogue
from horf_cli.environments import EnvSettings, make_env
from horf_cli.models import buffer_megabytes, new_model
from horf_cli.runs import Protocol
from horf_cli.training import run_config

from horf_env.errors import UnknownNameError
from sb3_bayes_dsac.common.encoders import DepthEncoder

ALGORITHMS = ("bayes_dsac", "dsac_t", "sac", "td3", "tqc", "ppo")


@pytest.fixture(scope="module")
def env():
    made = make_env(EnvSettings(scene="room", action_layer="joint_velocity"))
    yield made
    made.close()


def config(algo, steps=64):
    return run_config(
        algo=algo,
        env=EnvSettings(scene="room", action_layer="joint_velocity"),
        steps=steps,
        seed=3,
        threads=1,
        buffer_size=None,
        protocol=Protocol(),
    )


def test_the_promised_algorithms_are_there():
    assert set(catalogue().algorithms) == set(ALGORITHMS)


@pytest.mark.parametrize("algo", ALGORITHMS)
def test_same_encoder_and_nets_for_all(env, algo):
    settings = config(algo)
    model = new_model(settings, catalogue(), env)
    encoders = [m for m in model.policy.modules() if isinstance(m, DepthEncoder)]
    assert encoders
    assert {encoder.features_dim for encoder in encoders} == {32 + 7 + 9 + 3 + 6}
    assert model.policy.net_arch == [256, 256]
    assert model.seed == 3
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(settings.steps)
    assert any((p != q).any() for p, q in zip(before, model.policy.parameters(), strict=True))


def test_only_the_deterministic_policy_gets_action_noise(env):
    assert new_model(config("td3"), catalogue(), env).action_noise is not None
    assert new_model(config("sac"), catalogue(), env).action_noise is None


def test_short_runs_get_small_buffers_and_warm_ups():
    short, long = config("sac", 1000).arguments, config("sac", 10**6).arguments
    assert (short["buffer_size"], short["learning_starts"]) == (1000, 200)
    assert (long["buffer_size"], long["learning_starts"]) == (50_000, 2000)
    assert config("ppo", 300).arguments["n_steps"] == 300


def test_buffer_holds_two_observations_a_transition(env):
    # 5 x 48 x 64 bytes of images and 19 + 6 floats of 4 bytes, twice.
    assert buffer_megabytes(env.observation_space, 1000) == pytest.approx(
        2 * (5 * 48 * 64 + 4 * (7 + 9 + 3 + 6)) / 1000
    )


def test_unknown_algorithm():
    with pytest.raises(UnknownNameError, match="dsac_t"):
        catalogue().algorithm("dsact")
