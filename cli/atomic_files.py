"""Files that appear complete or not at all, also when the power fails."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from .exit_codes import CliError


class StorageError(CliError):
    """Something cannot be written: the disk is full, or the folder is read-only.

    Attributes:
        path: What was to be written.
    """

    def __init__(self, path: Path, error: OSError) -> None:
        self.path = path
        super().__init__(f"cannot write {path}: {error.strerror or error}")


def write_atomically(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a file under a temporary name, sync it, and rename it.

    Args:
        path: Name in the end; an existing file is replaced.
        write: Gets the open file.

    Raises:
        StorageError: If it cannot be written; nothing is left behind.
    """
    unfinished = path.with_name(f".{path.name}.part")
    try:
        write_synced(unfinished, write)
        os.replace(unfinished, path)
        sync_folder(path.parent)
    except OSError as error:
        with suppress(OSError):
            unfinished.unlink()
        raise StorageError(path, error) from error


def write_synced(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a file and wait until it is on the disk.

    Raises:
        OSError: If it cannot be written.
    """
    with path.open("wb") as file:
        write(file)
        file.flush()
        os.fsync(file.fileno())


def sync_folder(path: Path) -> None:
    """Wait until the names in a folder are on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
