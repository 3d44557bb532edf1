"""Policies in files: nothing in them is executed."""

import base64
import io
import json
import pickle
import zipfile

import cloudpickle
import numpy as np
import pytest
import safetensors.torch
import torch as th
from horf_cli.config import TrainConfig
from horf_cli.environments import EnvSettings
from horf_cli.exit_codes import CliError
from horf_cli.models import new_model
from horf_cli.policies import exported, load_policy
from horf_cli.policy_files import policy_bytes, read_policy
from horf_cli.runs import Manifest, RunFolder
from horf_cli.training_envs import training_envs

ENV = EnvSettings(scene="room", action_layer="joint_velocity", perception="full")


@pytest.fixture(scope="module")
def env():
    made = training_envs(TrainConfig(env=ENV))
    yield made
    made.close()


def config(algo):
    return TrainConfig(algo=algo, env=ENV, steps=10)


@pytest.fixture(scope="module")
def sac(env):
    return new_model(config("sac"), env)


@pytest.fixture
def file(sac, tmp_path):
    path = tmp_path / "policy.safetensors"
    path.write_bytes(policy_bytes(sac, algo="sac", env=ENV))
    return path


@pytest.mark.parametrize("algo", ["bayes_dsac", "dsac_t", "sac", "td3", "redq", "tqc", "ppo"])
def test_a_policy_read_back_acts_the_same(env, tmp_path, algo):
    model = new_model(config(algo), env)
    path = tmp_path / "policy.safetensors"
    path.write_bytes(policy_bytes(model, algo=algo, env=ENV))
    settings, policy = read_policy(path)
    assert (settings.algo, settings.env, settings.step) == (algo, ENV, 0)
    observation = {key: part[0] for key, part in env.reset().items()}
    expected, _ = model.predict(observation, deterministic=True)
    np.testing.assert_array_equal(policy.predict(observation, deterministic=True)[0], expected)
    planner = load_policy(path)
    np.testing.assert_array_equal(planner.act(observation), expected)
    assert planner.action_layer == "joint_velocity"


class Bomb:
    """Creates a file when it is unpickled."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


@pytest.fixture
def malicious(sac, tmp_path):
    """A model.zip that runs code wherever Stable-Baselines3 unpickles; and what it would create."""
    target = tmp_path / "executed"
    sound, path = io.BytesIO(), tmp_path / "model.zip"
    sac.save(sound)
    bomb = pickle.dumps(Bomb(target))
    with zipfile.ZipFile(sound) as source, zipfile.ZipFile(path, "w") as archive:
        for name in source.namelist():
            content = source.read(name)
            if name == "data":
                data = json.loads(content)
                data["gamma"] = {":type:": "x", ":serialized:": base64.b64encode(bomb).decode()}
                content = json.dumps(data).encode()
            archive.writestr(name, content)
    return path, target


@pytest.mark.parametrize("command", ["export", "demo", "evaluate"])
def test_a_malicious_zip_is_refused_and_nothing_is_executed(horf, malicious, tmp_path, command):
    path, target = malicious
    small = ["--methods", "horf", "--trials", 1, "--scenes", "room"]
    args = {
        "export": [path],
        "demo": ["--policy", path],
        "evaluate": ["--policy", path, *small],
    }[command]
    result = horf(command, *args, "--out", tmp_path / "out")
    assert result.exit_code in (1, 3)
    assert "may run any code" in result.stdout + result.stderr
    assert not target.exists()


def test_the_bomb_is_real(malicious):
    path, target = malicious
    load_policy(path, trust=True)
    assert target.exists()


def test_a_pickle_with_another_name_is_refused(tmp_path):
    path, target = tmp_path / "policy.safetensors", tmp_path / "executed"
    for content in (pickle.dumps(Bomb(target)), cloudpickle.dumps(Bomb(target)), b""):
        path.write_bytes(content)
        with pytest.raises(CliError, match=r"policy\.safetensors"):
            load_policy(path)
    assert not target.exists()


def test_a_trusted_zip_is_exported(horf, sac, tmp_path):
    zipped, out = tmp_path / "model.zip", tmp_path / "policy.safetensors"
    sac.save(zipped)
    result = horf("export", zipped, "-o", out, "--trust")
    assert result.exit_code == 0, result.output
    assert str(out) in result.stdout
    settings, policy = read_policy(out)
    assert (settings.algo, settings.env.action_layer) == ("sac", "joint_velocity")
    weights = sac.policy.state_dict()
    assert all(th.equal(weights[name], value) for name, value in policy.state_dict().items())
    again = horf("export", zipped, "-o", out, "--trust")
    assert again.exit_code == 1
    assert "exists" in again.stderr


def test_export_of_a_run_without_checkpoint(tmp_path):
    run = RunFolder(tmp_path)
    run.write(Manifest.of(config("sac")))
    with pytest.raises(CliError, match="no sound checkpoint"):
        exported(tmp_path)


def changed(file, **changes):
    """The same file with other settings."""
    with safetensors.safe_open(file, "pt") as source:
        settings = json.loads(source.metadata()["horf_policy"])
    weights = safetensors.torch.load_file(file)
    metadata = {"horf_policy": json.dumps(settings | changes)}
    safetensors.torch.save_file(weights, file, metadata)
    return file


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"version": 2}, "version"),
        ({"step": "many"}, "step"),
        ({"algo": "sca"}, "sac"),
        ({"networks": {"net_arch": [3, 3]}}, "size mismatch"),
        ({"networks": {"surprise": 1}}, "surprise"),
    ],
)
def test_settings_that_do_not_fit_are_named(file, changes, named):
    with pytest.raises(Exception, match=named) as caught:
        read_policy(changed(file, **changes))
    assert isinstance(caught.value, CliError | ValueError)


def test_a_file_of_another_program_and_a_truncated_one(file, tmp_path):
    file.write_bytes(file.read_bytes()[:-10])
    other = tmp_path / "other.safetensors"
    safetensors.torch.save_file({"x": th.zeros(1)}, other)
    for path in (file, other, tmp_path / "none.safetensors"):
        with pytest.raises(CliError, match=path.name):
            read_policy(path)
