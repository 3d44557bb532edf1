"""Options of `horf train`. Without a default: what is not given is left to the file of settings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import CONTROL, EXECUTION, EXPERIMENT, LIMITS, OUTPUT, PERCEPTION, SCENE, SIMULATION

_EVALUATION = "Evaluation"


def _complete_algorithms(incomplete: str) -> list[str]:
    from ..algorithms import catalogue

    return [name for name in catalogue().algorithms if name.startswith(incomplete)]


Algo = Annotated[
    str | None,
    typer.Option(
        help="bayes_dsac, dsac_t, sac, td3, redq, tqc, ppo or dagger.",
        show_default="bayes_dsac",
        autocompletion=_complete_algorithms,
        rich_help_panel=EXPERIMENT,
    ),
]
Scene = Annotated[str | None, SCENE]
Control = Annotated[str | None, CONTROL]
Limits = Annotated[str | None, LIMITS]
Perception = Annotated[str | None, PERCEPTION]
Simulation = Annotated[str | None, SIMULATION]
Steps = Annotated[
    int | None,
    typer.Option(
        min=1, help="Environment steps.", show_default="100000", rich_help_panel=EXPERIMENT
    ),
]
Seed = Annotated[
    int | None,
    typer.Option(min=0, help="Seed of the run.", show_default="0", rich_help_panel=EXPERIMENT),
]
ActionLayer = Annotated[
    str | None,
    typer.Option(
        help="What an action is: sdf_qp or sampled_qp (EE twist), or joint_velocity.",
        show_default="sdf_qp",
        rich_help_panel=EXPERIMENT,
    ),
]
ReplayRatio = Annotated[
    float | None,
    typer.Option(
        help="Gradient steps an environment step.",
        show_default="0.5",
        rich_help_panel=EXPERIMENT,
    ),
]
Config = Annotated[
    Path | None,
    typer.Option(help="Settings as TOML; options and -p win.", rich_help_panel=EXPERIMENT),
]
Parameters = Annotated[
    list[str] | None,
    typer.Option(
        "-p",
        metavar="KEY=VALUE",
        help="Any setting: learning_rate=3e-4 (of the algorithm), env.limits=paper, "
        "protocol.every=3000, storage.keep=5. May be repeated.",
        rich_help_panel=EXPERIMENT,
    ),
]
NEnvs = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Environments, each in its own process if there are several.",
        show_default="1",
        rich_help_panel=EXECUTION,
    ),
]
Device = Annotated[
    str | None, typer.Option(help="Of torch.", show_default="cpu", rich_help_panel=EXECUTION)
]
Threads = Annotated[
    int | None,
    typer.Option(min=1, help="Threads of torch.", show_default="1", rich_help_panel=EXECUTION),
]
EvaluateEvery = Annotated[
    int | None,
    typer.Option(
        min=1,
        help="Steps between two evaluations.",
        show_default="6000",
        rich_help_panel=_EVALUATION,
    ),
]
EvaluationEpisodes = Annotated[
    int | None,
    typer.Option(min=1, help="Episodes of each.", show_default="2", rich_help_panel=_EVALUATION),
]
FinalEpisodes = Annotated[
    int | None,
    typer.Option(
        min=1, help="Episodes at the end.", show_default="20", rich_help_panel=_EVALUATION
    ),
]
Out = Annotated[Path, typer.Option(help="Folder of all runs.", rich_help_panel=OUTPUT)]
Resume = Annotated[
    Path | None,
    typer.Option(help="Go on with this run; no other setting is needed.", rich_help_panel=OUTPUT),
]
Exact = Annotated[
    bool,
    typer.Option(
        "--exact",
        help="Resume only if what follows is bit-equal to a run without interruption.",
        rich_help_panel=OUTPUT,
    ),
]
DryRun = Annotated[
    bool,
    typer.Option("--dry-run", help="Print what would run, as JSON.", rich_help_panel=OUTPUT),
]
