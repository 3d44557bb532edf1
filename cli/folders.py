"""Output folders that never overwrite anything."""

from __future__ import annotations

from pathlib import Path


def new_folder(path: Path) -> Path:
    """Create a folder that did not exist before; parents are made as needed.

    Args:
        path: Wanted name. If it is taken: the same with "-2", "-3", ... appended.

    Returns:
        The folder. `mkdir` decides who gets a name, so two processes never share a folder.

    Raises:
        OSError: If no folder can be made there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    candidate, number = path, 1
    while True:
        try:
            candidate.mkdir()
        except FileExistsError:
            number += 1
            candidate = path.with_name(f"{path.name}-{number}")
        else:
            return candidate
