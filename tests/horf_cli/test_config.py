"""Settings of a run, from files and from the command line."""

import json
import os
import subprocess
import sys

import pytest
from horf_cli.config import TrainConfig
from horf_cli.config_files import ConfigError, make_config

from horf_env.errors import UnknownNameError

TOML = """
algo = "sac"
steps = 2000

[env]
scene = "room"

[settings]
learning_rate = 1e-4

[protocol]
every = 500
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "run.toml"
    path.write_text(TOML)
    return path


def test_what_comes_later_wins(file):
    config = make_config(
        file=file,
        options={"steps": 3000, "env.scene": "aisle", "seed": None},
        parameters=["env.scene=forest", "learning_rate=3e-4", "gamma=1"],
    )
    assert (config.algo, config.steps, config.seed) == ("sac", 3000, 0)
    assert (config.env.scene, config.env.limits) == ("forest", "ld60")
    assert config.settings == {"learning_rate": 3e-4, "gamma": 1}
    assert (config.protocol.every, config.protocol.episodes) == (500, 2)


@pytest.mark.parametrize(
    ("text", "value"),
    [("50000", 50_000), ("5e4", 50_000), ("5_0000", 50_000)],
)
def test_an_integer_may_be_written_as_people_do(text, value):
    assert make_config(parameters=[f"steps={text}"]).steps == value


@pytest.mark.parametrize(
    ("parameter", "named"),
    [
        ("steps=many", "'steps'"),
        ("steps=0", "'steps'"),
        ("steps=2.5", "'steps'"),
        ("replay_ratio=-1", "'replay_ratio'"),
        ("env.scene=3", "'env.scene'"),
        ("protocol.every=true", "'protocol.every'"),
        ("learning_rate=[1, 2]", "'settings.learning_rate'"),
        ("learning_rate", "key=value"),
        ("learning rate=3", "key=value"),
        ("=3", "key=value"),
    ],
)
def test_a_malformed_parameter_is_named_with_its_field(horf, parameter, named):
    result = horf("train", "-p", parameter)
    assert result.exit_code == 2
    (line,) = result.stderr.strip().splitlines()
    assert f"-p {parameter}" in line
    assert named in line


def test_a_wrong_option_of_a_command_is_named_as_typed():
    with pytest.raises(ConfigError, match=r"--replay-ratio: field 'replay_ratio'"):
        make_config(options={"replay_ratio": -2.0})


@pytest.mark.parametrize(
    ("old", "new", "line", "field"),
    [
        ("steps = 2000", "steps = = 1", "line 3", ""),
        ("steps = 2000", 'steps = "many"', "line 3", "'steps'"),
        ("every = 500", "every = 0", "line 12", "'protocol.every'"),
        ('scene = "room"', "scene = 1", "line 6", "'env.scene'"),
        ("learning_rate = 1e-4", "learning_rate = [1]", "line 9", "'settings.learning_rate'"),
        ('scene = "room"', 'scnee = "room"', "line 6", "did you mean 'env.scene'?"),
        ("steps = 2000", "stesp = 2000", "line 3", "did you mean 'steps'?"),
        ("[env]", "[envv]", "line 5", "'envv'"),
    ],
)
def test_a_malformed_file_is_named_with_line_and_field(horf, file, old, new, line, field):
    file.write_text(TOML.replace(old, new))
    result = horf("train", "--config", file)
    assert result.exit_code == 2
    (text,) = result.stderr.strip().splitlines()
    assert str(file) in text
    assert line in text
    assert field in text


@pytest.mark.parametrize(
    ("parameter", "nearest"),
    [
        ("learning_rat=1", "learning_rate"),
        ("env.scnee=room", "env.scene"),
        ("protocol.evry=5", "protocol.every"),
        ("env.scene=rom", "room"),
        ("algo=td4", "td3"),
    ],
)
def test_unknown_names_get_the_nearest(horf, parameter, nearest):
    result = horf("train", "-p", parameter)
    assert result.exit_code == 2
    assert f"did you mean {nearest!r}?" in result.stderr


def test_values_are_never_evaluated(tmp_path):
    target = tmp_path / "x"
    text = f"__import__('pathlib').Path('{target}').touch()"
    with pytest.raises((ConfigError, UnknownNameError)):
        make_config(parameters=[f"env.scene={text}"]).env.check()
    with pytest.raises(ConfigError):
        make_config(parameters=[f"steps={text}"])
    assert not target.exists()


def test_no_such_file(horf, tmp_path):
    result = horf("train", "--config", tmp_path / "none.toml")
    assert result.exit_code == 1
    assert "none.toml" in result.stderr


def test_json_round_trip(file):
    config = make_config(file=file, parameters=["replay_ratio=20"])
    assert TrainConfig.model_validate_json(config.model_dump_json()) == config


HASH = """
from horf_cli.config import TrainConfig
from horf_cli.environments import EnvSettings
print(TrainConfig(algo="sac", env=EnvSettings(scene="room"), settings={"tau": 0.01}).content_hash())
"""


def test_the_hash_is_the_same_in_another_process():
    run = [sys.executable, "-c", HASH]
    found = {
        subprocess.run(
            run,
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(found) == 1


def test_the_hash_names_what_is_computed():
    def hash_of(*parameters):
        return make_config(parameters=parameters).content_hash()

    assert hash_of() == hash_of("storage.keep=7") == hash_of("replay_ratio=0.5")
    assert hash_of() == hash_of("learning_rate=3e-4") == hash_of("algo=bayes_dsac")
    others = ["seed=1", "steps=5", "env.limits=paper", "gamma=0.9", "replay_ratio=1", "algo=sac"]
    assert len({hash_of(), *map(hash_of, others)}) == len(others) + 1


def test_dry_run_prints_what_would_run_and_makes_nothing(horf, tmp_path):
    out = tmp_path / "runs"
    result = horf("train", "--dry-run", "--algo", "sac", "--replay-ratio", 4, "--out", out)
    plan = json.loads(result.stdout)
    assert plan["config"]["algo"] == "sac"
    assert (plan["arguments"]["gradient_steps"], plan["arguments"]["train_freq"]) == (4, 1)
    assert len(plan["config_hash"]) == 16
    assert plan["folder"].startswith(f"{out}/forest/sac/seed0-")
    assert not out.exists()


def test_resume_takes_no_other_settings(horf, tmp_path):
    result = horf("train", "--resume", tmp_path, "--seed", 3)
    assert result.exit_code == 2
    assert "leave all others out" in result.stderr
    assert horf("train", "--exact").exit_code == 2
    nothing = horf("train", "--resume", tmp_path)
    assert nothing.exit_code == 1
    assert f"{tmp_path}: no run folder" in nothing.stderr
