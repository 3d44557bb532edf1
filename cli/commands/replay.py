"""`horf replay`: watch a recording, or read what it holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from ..options import Json

if TYPE_CHECKING:
    from horf_env.recording import RecordingSummary


def replay(
    recordings: Annotated[
        list[Path],
        typer.Argument(
            help="Recordings (.rrd), or folders such as that of a run: the newest recording in "
            "there. Several are shown together."
        ),
    ],
    web: Annotated[
        bool, typer.Option("--web", help="Serve a web viewer on 127.0.0.1 instead of a window.")
    ] = False,
    export: Annotated[
        Path | None,
        typer.Option(help="Write a video (*.mp4) or a folder of pictures; needs no display."),
    ] = None,
    summary: Annotated[
        bool, typer.Option("--summary", help="Print what the recordings hold; no viewer.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Show recordings: in a window, or in a browser where there is no display.

    What a killed process left is repaired, in a copy.
    """
    from ..console import notes
    from ..sound_recordings import sound_recording
    from ..viewer import has_display, show_window

    with TemporaryDirectory() as scratch:
        note = notes().print
        paths = [sound_recording(path, Path(scratch), note) for path in recordings]
        if export is not None:
            _export(paths, export)
        elif summary or as_json:
            _print_summaries(paths, as_json=as_json)
        elif web or not has_display():
            _serve(paths)
        else:
            show_window(paths)


def _export(paths: Sequence[Path], target: Path) -> None:
    from rich.progress import Progress

    from horf_env.recording import summarise

    from ..console import notes, results
    from ..video import export, frame_times

    duration = max(summarise(path).duration for path in paths)
    console = notes()
    with Progress(console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task("frames", total=len(frame_times(duration)))
        written = export(paths, duration, target, lambda: progress.advance(task))
    results().print(str(written), markup=False)


def _serve(paths: Sequence[Path]) -> None:
    from ..console import notes, results
    from ..viewer import web_viewer

    with web_viewer(paths) as viewer:
        results().print(f"{', '.join(map(str, paths))}: {viewer.url}")
        tunnels = " ".join(f"-L {port}:127.0.0.1:{port}" for port in viewer.ports)
        notes().print(f"Ctrl-C ends. From another machine first: ssh {tunnels} <this machine>")
        viewer.process.wait()


def _print_summaries(paths: Sequence[Path], *, as_json: bool) -> None:
    from horf_env.recording import summarise

    from ..console import print_json, results

    found = [summarise(path) for path in paths]
    if as_json:
        rows = [{**asdict(one), "path": str(one.path), "success": one.success} for one in found]
        print_json(rows[0] if len(rows) == 1 else rows)
        return
    console = results()
    for line in (line for one in found for line in _lines(one)):
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
