"""`horf replay`: watch a recording, or read what it holds."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..exit_codes import CliError
from ..options import Json

if TYPE_CHECKING:
    from horf_env.recording import RecordingSummary


def replay(
    recording: Annotated[
        Path, typer.Argument(help="A recording (.rrd), or a folder: its newest recording.")
    ],
    web: Annotated[
        bool, typer.Option("--web", help="Serve a web viewer on 127.0.0.1 instead of a window.")
    ] = False,
    summary: Annotated[
        bool, typer.Option("--summary", help="Print what the recording holds; no viewer.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Show a recording: in a window, or in a browser where there is no display."""
    from ..viewer import has_display, show_window, verify

    path = _find(recording)
    verify(path)
    if summary or as_json:
        _print_summary(path, as_json=as_json)
    elif web or not has_display():
        _serve(path)
    else:
        show_window(path)


def _find(path: Path) -> Path:
    """The file itself, or the newest recording in a folder."""
    if path.is_file():
        return path
    found = sorted(path.rglob("*.rrd"), key=lambda file: (file.stat().st_mtime, file.name))
    if not found:
        raise CliError(
            f"{path}: {'no recording (*.rrd) in there' if path.is_dir() else 'no such file'}"
        )
    return found[-1]


def _serve(path: Path) -> None:
    from ..console import notes, results
    from ..viewer import web_viewer

    with web_viewer(path) as viewer:
        results().print(f"{path}: {viewer.url}")
        tunnels = " ".join(f"-L {port}:127.0.0.1:{port}" for port in viewer.ports)
        notes().print(f"Ctrl-C ends. From another machine first: ssh {tunnels} <this machine>")
        viewer.process.wait()


def _print_summary(path: Path, *, as_json: bool) -> None:
    from horf_env.recording import summarise

    from ..console import print_json, results

    found = summarise(path)
    if as_json:
        print_json({**asdict(found), "path": str(path), "success": found.success})
        return
    console = results()
    for line in _lines(found):
        console.print(line, markup=False)


def _lines(found: RecordingSummary) -> list[str]:
    return [
        f"recording  {found.path}",
        *(f"  {name:<14} {value}" for name, value in sorted(found.properties.items())),
        f"episode    {found.steps} steps, {found.duration:.2f} s, success: {found.success}, "
        f"least clearance {found.min_distance:.3f} m",
        "timelines",
        *(f"  {name:<14} {low:g} to {high:g}" for name, (low, high) in found.timelines.items()),
        "entities",
        *(f"  {entity}" for entity in found.entities),
    ]
