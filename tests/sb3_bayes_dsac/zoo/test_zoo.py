"""The command line `python -m sb3_bayes_dsac.zoo` and the hyperparameters that it brings."""

from __future__ import annotations

import sys
from importlib import resources
from pathlib import Path

import pytest
from stable_baselines3.common.save_util import load_from_zip_file

from sb3_bayes_dsac import BayesDSAC
from sb3_bayes_dsac.zoo.__main__ import main
from sb3_bayes_dsac.zoo.registration import ALGORITHMS, with_hyperparameters


@pytest.fixture
def zoo(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Run the command line in a folder of its own."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> None:
        monkeypatch.setattr(sys, "argv", ["zoo", *arguments])
        main()

    return run


def test_says_what_to_install(zoo, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "rl_zoo3", None)
    with pytest.raises(SystemExit, match=r"rl_zoo3.*pip install 'horf\[zoo\]'"):
        zoo("train", "--algo", "bayes_dsac")


@pytest.mark.parametrize("arguments", [[], ["learn"]])
def test_says_which_commands_there_are(zoo, arguments: list[str]) -> None:
    with pytest.raises(SystemExit, match="train, enjoy"):
        zoo(*arguments)


@pytest.mark.parametrize("algo", ALGORITHMS)
def test_hyperparameters_come_with_the_package(algo: str) -> None:
    argv = with_hyperparameters(["zoo", "train", "--env", "Pendulum-v1", f"--algo={algo}"])
    assert argv[:5] == ["zoo", "train", "--env", "Pendulum-v1", f"--algo={algo}"]
    assert argv[5] == "-conf"
    assert Path(argv[6]).name == f"{algo}.yml"
    text = (resources.files("sb3_bayes_dsac.zoo") / "hyperparams" / f"{algo}.yml").read_text()
    assert Path(argv[6]).read_text() == text
    for entry in ("default:", "Pendulum-v1:", "HalfCheetah-v5:", "Hopper-v5:"):
        assert entry in text


@pytest.mark.parametrize(
    "arguments",
    [
        ["train", "--algo", "sac"],
        ["train"],
        ["train", "--algo", "redq", "-conf", "own.yml"],
        ["train", "--algo", "redq", "--conf-file", "own.yml"],
        ["enjoy", "--algo", "redq"],
    ],
)
def test_other_command_lines_stay_as_they_are(arguments: list[str]) -> None:
    assert with_hyperparameters(["zoo", *arguments]) == ["zoo", *arguments]


@pytest.mark.parametrize("algo", ALGORITHMS)
def test_trains_and_plays(zoo, tmp_path: Path, capsys: pytest.CaptureFixture, algo: str) -> None:
    pytest.importorskip("rl_zoo3")
    common = ["--algo", algo, "--env", "Pendulum-v1", "--device", "cpu", "-f", "logs"]
    params = ["policy_kwargs:dict(net_arch=[16,16])", "learning_starts:450", "gradient_steps:2"]
    zoo("train", *common, "-n", "500", "--eval-freq", "-1", "--seed", "1", "-params", *params)
    saved = tmp_path / "logs" / algo / "Pendulum-v1_1" / "Pendulum-v1.zip"
    data, _, _ = load_from_zip_file(saved)
    assert data is not None
    assert data["num_timesteps"] == 500
    assert data["_n_updates"] == 2 * 50
    assert data["learning_rate"](1.0) == 1e-3
    model = ALGORITHMS[algo].load(saved, device="cpu")
    assert isinstance(model, BayesDSAC) == (algo == "bayes_dsac")
    capsys.readouterr()
    zoo("enjoy", *common, "-n", "200", "--no-render")
    assert "Episode Reward" in capsys.readouterr().out
