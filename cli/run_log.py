"""The rows that a run writes: values of the logger, training episodes, evaluations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from numbers import Real
from pathlib import Path
from typing import Any

from stable_baselines3.common.logger import KVWriter, Logger, TensorBoardOutputFormat
from torch.utils.tensorboard import SummaryWriter

from .atomic_files import StorageError
from .clock import Clock
from .episodes import Trial
from .metrics import EVALUATIONS, METRICS, PartWriter
from .runs import RunFolder

# SB3's, which begin at 0 again when a run is resumed; the column wall_time does not.
_LEFT_OUT = {"time/fps", "time/time_elapsed", "time/iterations", "time/total_timesteps"}


class RunLog(KVWriter):
    """Takes what SB3's logger writes, and rows; see `metrics` for where they go.

    Attributes:
        logger: For the model; writes here and to TensorBoard.
        metrics: Rows of metrics.
        evaluations: Rows of evaluation episodes.
    """

    def __init__(
        self, folder: RunFolder, clock: Clock, *, step: int, parts: tuple[int, int]
    ) -> None:
        """Open the files of a run.

        Args:
            folder: Of the run.
            clock: Its seconds.
            step: Environment steps so far; TensorBoard forgets what came later.
            parts: How many parts of metrics and of evaluations count.
        """
        self._clock = clock
        self.metrics = PartWriter(folder.path / METRICS, parts[0])
        self.evaluations = PartWriter(folder.path / EVALUATIONS, parts[1])
        self.logger = Logger(str(folder.path), [self, _TensorBoard(folder.tensorboard, step)])

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        """Take values of the logger."""
        self.add(step, {k: v for k, v in key_values.items() if k not in _LEFT_OUT})

    def close(self) -> None:
        """Nothing is open between two parts."""

    def add(self, step: int, values: Mapping[str, Any]) -> None:
        """Take values that are numbers."""
        now = self._clock.read().total
        self.metrics.add(
            [
                {"step": step, "wall_time": now, "name": name, "value": float(value)}
                for name, value in values.items()
                if isinstance(value, Real)
            ]
        )

    def add_episodes(self, step: int, infos: Iterable[Mapping[str, Any]]) -> None:
        """Take the training episodes that ended with this step."""
        for info in infos:
            if "episode" in info:
                values = {
                    "episode/return": info["episode"]["r"],
                    "episode/length": info["episode"]["l"],
                    "episode/success": float(info["is_success"]),
                    "episode/collision": float(info["is_collision"]),
                }
                self.add(step, values)

    def add_evaluation(self, step: int, protocol: str, trials: Sequence[Trial]) -> None:
        """Take the episodes of an evaluation."""
        head = {"step": step, "wall_time": self._clock.read().total, "protocol": protocol}
        rows = []
        for episode, trial in enumerate(trials):
            row = asdict(trial)
            names = {"return": row.pop("episode_return"), "length": row.pop("steps")}
            rows.append(head | {"episode": episode} | row | names)
        self.evaluations.add(rows)

    def flush(self) -> None:
        """Write what was taken.

        Raises:
            StorageError: If it cannot be written.
        """
        self.metrics.flush()
        self.evaluations.flush()

    @property
    def pending(self) -> tuple[dict[str, Any], dict[str, int], dict[str, Any]]:
        """What the logger was told and has not written."""
        logger = self.logger
        return dict(logger.name_to_value), dict(logger.name_to_count), dict(logger.name_to_excluded)

    def restore(self, pending: tuple[dict[str, Any], dict[str, int], dict[str, Any]]) -> None:
        """Tell the logger what it was told before."""
        self.logger.name_to_value.update(pending[0])
        self.logger.name_to_count.update(pending[1])
        self.logger.name_to_excluded.update(pending[2])


class _TensorBoard(TensorBoardOutputFormat):
    """TensorBoard's events; says which folder cannot be written to.

    Args:
        folder: Of the events.
        step: Events of later steps are taken back: they belong to what a killed run lost.
    """

    def __init__(self, folder: Path, step: int) -> None:
        super().__init__(str(folder))
        self._folder = folder
        if step:
            self.writer.close()
            self.writer = SummaryWriter(str(folder), purge_step=step + 1)

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0
    ) -> None:
        """Write values."""
        try:
            super().write(key_values, key_excluded, step)
        except OSError as error:
            raise StorageError(self._folder, error) from error

    def close(self) -> None:
        """Write what waits."""
        try:
            super().close()
        except OSError as error:
            raise StorageError(self._folder, error) from error
