"""The `horf` command: assembles the commands, and turns errors into exit codes.

Nothing heavy is imported before a command runs, so that help and completion answer at once.
"""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from .commands.compare import compare
from .commands.demo import demo
from .commands.doctor import doctor
from .commands.evaluate import evaluate
from .commands.export import export
from .commands.replay import replay
from .commands.report import report
from .commands.scenes import scenes
from .commands.train import train
from .exit_codes import exit_code, one_line


class ReportingGroup(TyperGroup):
    """Reports errors that are no bugs in one line on stderr."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command; `--debug` lets every error through with its trace."""
        try:
            return super().invoke(ctx)
        except (typer.Exit, typer.Abort):
            raise
        except Exception as error:
            code = exit_code(error)
            if code is None or ctx.params.get("debug"):
                raise
            typer.echo(f"horf: {one_line(error)}", err=True)
            raise typer.Exit(code) from None


app = typer.Typer(
    cls=ReportingGroup,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    epilog="Exit codes: 0 done, 1 error, 2 wrong usage, 3 done but some jobs failed, "
    "130 interrupted.",
)

for command in (demo, train, compare, report, export, evaluate, replay, scenes, doctor):
    app.command()(command)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"horf {version('horf')}")
        raise typer.Exit


@app.callback()
def options(
    show_version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the trace of an error.")] = False,
) -> None:
    """Reactive whole-body motion of a mobile manipulator: train, evaluate, watch."""


def main() -> None:
    """Run the command line."""
    app()
