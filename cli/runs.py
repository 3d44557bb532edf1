"""Run folders: what a training run leaves on disk, and its manifest."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveInt, ValidationError

from .environments import EnvSettings
from .exit_codes import CliError
from .folders import new_folder
from .provenance import git_revision, machine, versions

Status = Literal["running", "completed", "interrupted", "failed"]


class Protocol(BaseModel):
    """When and how a policy is evaluated while it learns.

    Attributes:
        every: Steps between two evaluations; 6000 in the paper.
        episodes: Episodes of each, on validation instances without action noise; 2 in the paper.
        final_episodes: Episodes at the end.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    every: PositiveInt = 6000
    episodes: PositiveInt = 2
    final_episodes: PositiveInt = 20


class RunConfig(BaseModel):
    """Everything that decides what a training run does.

    Attributes:
        algo: Name of the algorithm.
        arguments: Its arguments.
        env: The environment.
        steps: Environment steps.
        seed: Of networks, exploration and training instances.
        threads: Threads of torch.
        protocol: Evaluation.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    algo: str
    arguments: dict[str, Any]
    env: EnvSettings
    steps: PositiveInt
    seed: int = Field(ge=0)
    threads: PositiveInt
    protocol: Protocol


class Manifest(BaseModel):
    """Content of manifest.json."""

    model_config = ConfigDict(extra="forbid")

    config: RunConfig
    command: list[str] = Field(default_factory=lambda: list(sys.argv))
    versions: dict[str, str] = Field(default_factory=versions)
    git_revision: str | None = Field(default_factory=git_revision)
    machine: dict[str, str | int] = Field(default_factory=machine)
    started: datetime = Field(default_factory=lambda: datetime.now(UTC))
    ended: datetime | None = None
    status: Status = "running"
    steps_done: int = 0


@dataclass(frozen=True)
class RunFolder:
    """Paths inside the folder of a run."""

    path: Path

    @classmethod
    def create(cls, root: Path, config: RunConfig) -> RunFolder:
        """Make `root/<scene>/<algo>/seed<k>-<time>/`, a folder that did not exist.

        Raises:
            OSError: If it cannot be made.
        """
        time = datetime.now().strftime("%Y%m%d-%H%M%S")
        name = Path(config.env.scene_name, config.algo, f"seed{config.seed}-{time}")
        folder = cls(new_folder(root / name))
        folder.last.parent.mkdir()
        folder.recordings.mkdir()
        folder.write(Manifest(config=config))
        return folder

    @classmethod
    def around(cls, path: Path) -> RunFolder:
        """The run that a folder is, or that a checkpoint belongs to."""
        return cls(path if path.is_dir() else path.parent.parent)

    @property
    def manifest(self) -> Path:
        """What the run is."""
        return self.path / "manifest.json"

    @property
    def best(self) -> Path:
        """Checkpoint of the best evaluation."""
        return self.path / "checkpoints" / "best.zip"

    @property
    def last(self) -> Path:
        """Latest checkpoint."""
        return self.path / "checkpoints" / "last.zip"

    @property
    def evaluations(self) -> Path:
        """Trials of all evaluations."""
        return self.path / "evaluations.csv"

    @property
    def recordings(self) -> Path:
        """Folder of recordings."""
        return self.path / "recordings"

    @property
    def logs(self) -> Path:
        """Folder of TensorBoard's events and progress.csv."""
        return self.path / "logs"

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
        """Replace the manifest at once."""
        unfinished = self.manifest.with_name(f".{self.manifest.name}.part")
        unfinished.write_text(manifest.model_dump_json(indent=2))
        os.replace(unfinished, self.manifest)

    def finish(self, status: Status, steps_done: int) -> None:
        """Note in the manifest how the run ended."""
        update = {"status": status, "steps_done": steps_done, "ended": datetime.now(UTC)}
        self.write(self.read().model_copy(update=update))
