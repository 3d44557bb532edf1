"""The bias of the critics at the end of a run, kept beside the run's other results."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from sb3_bayes_dsac.common.q_bias import estimate_q_bias
from sb3_bayes_dsac.errors import ArgumentError

from .algorithms import catalogue
from .atomic_files import write_atomically
from .checkpoints import MODEL, checkpoints
from .environments import make_env
from .runs import RunFolder

_EPISODES = 3
_FILE = "q_bias.json"


def measure_q_bias(run: RunFolder) -> None:
    """Measure the bias of a finished run with its last critics, unless that was done before.

    Three episodes on random training instances, or as many as the run's last evaluation has if
    these are fewer. On-policy algorithms have no Q.
    """
    if not is_q_bias_missing(run):
        return
    config = run.read().config
    episodes = min(_EPISODES, config.protocol.final_episodes)
    model_file = checkpoints(run.checkpoints)[0].verified(MODEL)
    algorithm = catalogue().algorithm(config.algo).load()
    model = algorithm.load(model_file, device="cpu", buffer_size=1)
    env = make_env(config.env)
    try:
        found: dict[str, Any] = asdict(
            estimate_q_bias(cast(OffPolicyAlgorithm, model), env, n_episodes=episodes)
        )
    except ArgumentError as error:  # time-outs hide all returns
        found = {"error": str(error)}
    finally:
        env.close()
    text = json.dumps(found, indent=2).encode()
    write_atomically(run.path / _FILE, lambda file: file.write(text))


def is_q_bias_missing(run: RunFolder) -> bool:
    """Whether a run has a Q whose bias was not measured."""
    kind = catalogue().algorithm(run.read().config.algo).kind
    return kind == "off_policy" and not (run.path / _FILE).exists()


def read_q_bias(run: Path) -> dict[str, Any] | None:
    """What was measured: the fields of `QBias`, or an "error"; None if nothing was."""
    path = run / _FILE
    found: dict[str, Any] | None = json.loads(path.read_bytes()) if path.exists() else None
    return found
