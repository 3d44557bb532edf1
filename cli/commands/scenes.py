"""`horf scenes`: what the scene families are."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import Json


def scenes(
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to make, for one picture a family; numbered if the name is taken."
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """List the scene families and their instances; draw some of them from above."""
    from rich.table import Table

    from horf_env.scenes import SCENES
    from horf_env.scenes.instances import SPLITS, instances

    from ..console import print_json, results

    rows = [
        {
            "scene": name,
            "base_path": family.base_path,
            **{split: len(getattr(instances(name), split)) for split in SPLITS},
        }
        for name, family in SCENES.items()
    ]
    folder = _draw_all(out) if out is not None else None
    if as_json:
        print_json({"scenes": rows, "pictures": str(folder) if folder else None})
        return
    table = Table("scene", "base path in the paper / m", *SPLITS)
    for row in rows:
        table.add_row(*map(str, row.values()))
    results().print(table)
    if folder:
        results().print(f"pictures: {folder}")


def _draw_all(out: Path) -> Path:
    from horf_env.scenes import SCENES

    from ..folders import new_folder
    from ..scene_figure import save_family_figure

    folder = new_folder(out)
    for name in SCENES:
        save_family_figure(folder / f"{name}.png", name)
    return folder
