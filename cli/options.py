"""Options that several commands share, with the same names, help and completion."""

from __future__ import annotations

from typing import Annotated

import typer

# Panels of the help text.
EXPERIMENT = "Experiment"
EXECUTION = "Execution"
OUTPUT = "Output"


def complete_scenes(incomplete: str) -> list[str]:
    """Scene families that begin so."""
    from horf_env.scenes import SCENES

    return [name for name in SCENES if name.startswith(incomplete)]


def listed(text: str) -> list[str]:
    """Names in a list with commas, each once, in their order."""
    return list(dict.fromkeys(name.strip() for name in text.split(",")))


SCENE = typer.Option(
    help="aisle, room, forest, doorway, mixed (all four), or the path of a scene file (JSON).",
    autocompletion=complete_scenes,
    rich_help_panel=EXPERIMENT,
)
CONTROL = typer.Option(help="Preset of the QP: default or paper.", rich_help_panel=EXPERIMENT)
LIMITS = typer.Option(help="Limits profile: ld60 or paper.", rich_help_panel=EXPERIMENT)
PERCEPTION = typer.Option(
    help="What the action layer knows: camera, or full for the true surfaces.",
    rich_help_panel=EXPERIMENT,
)
SIMULATION = typer.Option(help="kinematic (exact) or dynamic (motors).", rich_help_panel=EXPERIMENT)

Control = Annotated[str, CONTROL]
Limits = Annotated[str, LIMITS]
Perception = Annotated[str, PERCEPTION]
Simulation = Annotated[str, SIMULATION]
Json = Annotated[
    bool, typer.Option("--json", help="Print the result as JSON.", rich_help_panel=OUTPUT)
]
BackendName = Annotated[
    str,
    typer.Option(
        help="local (processes) or ray (a cluster; pip install 'horf[ray]').",
        rich_help_panel=EXECUTION,
    ),
]
Workers = Annotated[
    int, typer.Option(min=1, help="Jobs at a time, one thread each.", rich_help_panel=EXECUTION)
]
Address = Annotated[
    str | None,
    typer.Option(
        help="Ray cluster that runs already (host:port); by default one on this machine, which "
        "listens on 127.0.0.1 only.",
        rich_help_panel=EXECUTION,
    ),
]
