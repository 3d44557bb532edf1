"""`horf export`: a policy as a file that runs no code when it is read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..options import EXECUTION, OUTPUT, Json


def export(
    policy: Annotated[
        Path, typer.Argument(help="A run folder, or a model.zip of Stable-Baselines3 (--trust).")
    ],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="New file.", rich_help_panel=OUTPUT)
    ] = Path("policy.safetensors"),
    trust: Annotated[
        bool,
        typer.Option(
            "--trust",
            help="Load a zip. It may run any code: only your own.",
            rich_help_panel=EXECUTION,
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Write a policy as safetensors: weights, and settings as JSON.

    Of a run it is the policy of the best evaluation. `horf evaluate` and
    `horf demo` read the file with --policy; nothing in it is executed.
    """
    from ..atomic_files import write_atomically
    from ..console import print_json, results
    from ..policies import exported

    if out.exists():
        raise FileExistsError(f"{out} exists: give another name")
    if not out.resolve().parent.is_dir():
        raise FileNotFoundError(f"no folder {out.resolve().parent}")
    content = exported(policy, trust=trust)
    write_atomically(out, lambda file: file.write(content))
    if as_json:
        print_json({"file": str(out), "bytes": len(content)})
    else:
        results().print(f"{out}: {len(content) / 1e6:.1f} MB")
