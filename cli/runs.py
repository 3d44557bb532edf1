"""Run folders: what a training run leaves on disk, its manifest, and who may write there."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from filelock import FileLock, Timeout
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from .atomic_files import StorageError, write_atomically
from .config import TrainConfig
from .exit_codes import CliError
from .folders import new_folder
from .provenance import git_revision, machine, versions

Status = Literal["running", "finished", "failed", "interrupted"]


def _now() -> datetime:
    return datetime.now(UTC)


class Resumption(BaseModel):
    """That a run was continued.

    Attributes:
        status: What it was until then; "running" after a SIGKILL.
        steps: Environment steps done until then; None if nobody could note them.
        time: When it was continued.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    status: Status
    steps: int | None
    time: datetime = Field(default_factory=_now)


class Manifest(BaseModel):
    """Content of manifest.json.

    Attributes:
        config: Settings of the run; with seed, device and threads.
        config_hash: `TrainConfig.content_hash` of them.
        arguments: What the algorithm was called with.
        command: As typed.
        versions: Of Python and packages.
        git_revision: Of the code, if known.
        machine: Processor, cores, system.
        started: When.
        ended: When, if it has.
        status: What became of it; "running" also after a SIGKILL.
        steps_done: Environment steps, when it ended.
        error: Why it failed, in one line.
        resumed: Each time it was continued.
    """

    model_config = ConfigDict(extra="forbid")

    config: TrainConfig
    config_hash: str
    arguments: dict[str, Any]
    command: list[str] = Field(default_factory=lambda: list(sys.argv))
    versions: dict[str, str] = Field(default_factory=versions)
    git_revision: str | None = Field(default_factory=git_revision)
    machine: dict[str, str | int] = Field(default_factory=machine)
    started: datetime = Field(default_factory=_now)
    ended: datetime | None = None
    status: Status = "running"
    steps_done: int = 0
    error: str = ""
    resumed: list[Resumption] = Field(default_factory=list)

    @classmethod
    def of(cls, config: TrainConfig) -> Manifest:
        """The manifest of a run that begins now."""
        return cls(
            config=config, config_hash=config.content_hash(), arguments=dict(config.arguments())
        )


@dataclass(frozen=True)
class RunFolder:
    """Paths inside the folder of a run."""

    path: Path

    @classmethod
    def create(cls, root: Path, config: TrainConfig) -> RunFolder:
        """Make `root/<scene>/<algo>/seed<k>-<time>/`, an empty folder that did not exist.

        Raises:
            StorageError: If it cannot be made.
        """
        time = datetime.now().strftime("%Y%m%d-%H%M%S")
        name = Path(config.env.scene_name, config.algo, f"seed{config.seed}-{time}")
        try:
            return cls(new_folder(root / name))
        except OSError as error:
            raise StorageError(root / name, error) from error

    @classmethod
    def around(cls, path: Path) -> RunFolder:
        """The run that a folder is, or that a file of a checkpoint belongs to."""
        return cls(path if path.is_dir() else path.parent.parent.parent)

    @property
    def manifest(self) -> Path:
        """What the run is."""
        return self.path / "manifest.json"

    @property
    def checkpoints(self) -> Path:
        """Folder of checkpoints."""
        return self.path / "checkpoints"

    @property
    def recordings(self) -> Path:
        """Folder of recordings."""
        return self.path / "recordings"

    @property
    def tensorboard(self) -> Path:
        """Folder of TensorBoard's events."""
        return self.path / "tensorboard"

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other processes out; the kernel unlocks when this one ends, however it ends.

        Raises:
            CliError: If another process is at work there.
            StorageError: If the folder cannot be written to.
        """
        lock = FileLock(self.path / ".lock")
        try:
            lock.acquire(blocking=False)
        except Timeout as error:
            raise CliError(
                f"{self.path}: another process is training there; wait, or end it"
            ) from error
        except OSError as error:
            raise StorageError(self.path, error) from error
        with lock:
            yield

    def read(self) -> Manifest:
        """Read the manifest.

        Raises:
            CliError: If there is none, or it is malformed.
        """
        try:
            return Manifest.model_validate_json(self.manifest.read_bytes())
        except OSError as error:
            raise CliError(
                f"{self.path}: no run folder ({self.manifest.name}: {error.strerror})"
            ) from error
        except ValidationError as error:
            first = error.errors()[0]
            field = ".".join(map(str, first["loc"])) or "whole file"
            raise CliError(f"{self.manifest}: field {field!r}: {first['msg']}") from error

    def write(self, manifest: Manifest) -> None:
        """Replace the manifest at once.

        Raises:
            StorageError: If it cannot be written; the old one stays.
        """
        text = manifest.model_dump_json(indent=2)
        write_atomically(self.manifest, lambda file: file.write(text.encode()))

    def resume(self) -> None:
        """Note in the manifest that the run goes on.

        Raises:
            StorageError: If that cannot be written.
        """
        manifest = self.read()
        steps = manifest.steps_done if manifest.status == "interrupted" else None
        resumed = [*manifest.resumed, Resumption(status=manifest.status, steps=steps)]
        update = {"resumed": resumed, "status": "running", "ended": None, "error": ""}
        self.write(manifest.model_copy(update=update))

    def finish(self, status: Status, steps_done: int, error: str = "") -> None:
        """Note in the manifest how the run ended."""
        update = {"status": status, "steps_done": steps_done, "ended": _now(), "error": error}
        self.write(self.read().model_copy(update=update))
