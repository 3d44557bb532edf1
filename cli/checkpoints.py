"""Checkpoints of a run: folders that appear complete, with a checksum of each file.

Only `state.pkl`, `buffer.pkl` and `model.zip` are unpickled, only to resume one's own run, and only
after their checksums were met.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from .atomic_files import StorageError, sync_folder, write_synced
from .exit_codes import CliError

MODEL = "model.zip"
POLICY = "policy.safetensors"
BEST = "best.safetensors"
STATE = "state.pkl"
BUFFER = "buffer.pkl"
_CHECKSUMS = "checksums.json"
_TRAINING_ONLY = (STATE, BUFFER)

Writers = Mapping[str, Callable[[BinaryIO], object]]
"""What to write under which name."""


class DamagedCheckpointError(CliError):
    """A file of a checkpoint is not what was written.

    Attributes:
        path: The file.
    """

    def __init__(self, path: Path, reason: str) -> None:
        self.path = path
        super().__init__(f"{path}: damaged checkpoint ({reason})")


@dataclass(frozen=True)
class Checkpoint:
    """A checkpoint, `<number>-step<step>/`."""

    path: Path

    @property
    def number(self) -> int:
        """Later checkpoints of a run have higher ones."""
        return int(self.path.name.split("-")[0])

    @property
    def step(self) -> int:
        """Environment steps until then."""
        return int(self.path.name.split("-step")[1])

    def __contains__(self, name: str) -> bool:
        return (self.path / name).is_file()

    def verified(self, name: str) -> Path:
        """A file whose checksum is right.

        Raises:
            DamagedCheckpointError: If it is not, or the file is missing.
        """
        path = self.path / name
        try:
            expected = json.loads((self.path / _CHECKSUMS).read_text())[name]
            with path.open("rb") as file:
                found = hashlib.file_digest(file, "sha256").hexdigest()
        except (OSError, ValueError, KeyError) as error:
            raise DamagedCheckpointError(path, f"{type(error).__name__}: {error}") from error
        if found != expected:
            raise DamagedCheckpointError(path, "its checksum is wrong")
        return path


def checkpoints(folder: Path) -> list[Checkpoint]:
    """Complete checkpoints, the newest first."""
    found = [Checkpoint(path) for path in folder.glob("[0-9]*-step[0-9]*") if path.is_dir()]
    return sorted(found, key=lambda checkpoint: -checkpoint.number)


def write_checkpoint(folder: Path, step: int, writers: Writers, *, keep: int) -> Checkpoint:
    """Write a checkpoint and delete the oldest.

    Args:
        folder: Folder of all checkpoints of a run.
        step: Environment steps so far.
        writers: Files.
        keep: How many checkpoints stay.

    Raises:
        StorageError: If it cannot be written; those before stay as they are.
    """
    before = checkpoints(folder)
    number = before[0].number + 1 if before else 1
    final = folder / f"{number:06d}-step{step:08d}"
    unfinished = folder / f".{final.name}.part"
    try:
        unfinished.mkdir(parents=True)
        _write(unfinished, writers)
        os.replace(unfinished, final)
        sync_folder(folder)
    except OSError as error:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise StorageError(final, error) from error
    for old in before[keep - 1 :]:
        shutil.rmtree(old.path)
    return Checkpoint(final)


def forget_after(folder: Path, checkpoint: Checkpoint | None) -> None:
    """Delete what is unfinished, and checkpoints later than one (all for None)."""
    last = checkpoint.number if checkpoint else 0
    for path in folder.glob(".*.part"):
        shutil.rmtree(path)
    for later in checkpoints(folder):
        if later.number > last:
            shutil.rmtree(later.path)


def forget_training(folder: Path) -> None:
    """Delete what only a resume needs: the run is finished."""
    for checkpoint in checkpoints(folder):
        for name in _TRAINING_ONLY:
            with suppress(FileNotFoundError):
                (checkpoint.path / name).unlink()


def _write(folder: Path, writers: Writers) -> None:
    sums = {}
    for name, write in writers.items():
        write_synced(folder / name, write)
        with (folder / name).open("rb") as file:
            sums[name] = hashlib.file_digest(file, "sha256").hexdigest()
    text = json.dumps(sums, indent=2).encode()
    write_synced(folder / _CHECKSUMS, lambda file: file.write(text))
    sync_folder(folder)
