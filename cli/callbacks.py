"""What happens beside learning: progress, Ctrl-C, evaluation with checkpoints and recordings."""

from __future__ import annotations

import csv
import time
from collections.abc import Sequence
from dataclasses import asdict, fields

import numpy as np
from rich.progress import Progress
from stable_baselines3.common.callbacks import BaseCallback

from horf_env.recording import EpisodeRecorder

from .environments import Env
from .episodes import Observer, Trial, run_episode
from .interruption import Interruption
from .models import save_model
from .policies import PolicyPlanner
from .recordings import save_recording
from .runs import RunConfig, RunFolder

_SPLIT = "validation"
_LINES_WITHOUT_BAR = 10  # progress lines of a run whose stderr is no terminal


class ShowProgress(BaseCallback):
    """Moves the progress bar; writes lines instead where there is no terminal."""

    def __init__(self, progress: Progress, config: RunConfig) -> None:
        super().__init__()
        self._progress, self._steps = progress, config.steps
        self._task = progress.add_task(config.algo, total=config.steps, rate="", success="")
        self._next_line = config.steps // _LINES_WITHOUT_BAR
        self._begin = time.perf_counter()

    def _on_step(self) -> bool:
        done = self.num_timesteps
        rate = done / (time.perf_counter() - self._begin)
        successes = list(self.model.ep_success_buffer or ())
        share = f"{np.mean(successes):.0%}" if successes else "-"
        self._progress.update(
            self._task, completed=done, rate=f"{rate:.1f} steps/s", success=f"success {share}"
        )
        if not self._progress.console.is_terminal and done >= self._next_line:
            self._next_line += max(self._steps // _LINES_WITHOUT_BAR, 1)
            self._progress.console.print(
                f"step {done} of {self._steps}, {rate:.1f} steps/s, success {share}"
            )
        return True


class CheckInterruption(BaseCallback):
    """Lets a Ctrl-C through between two steps."""

    def __init__(self, interruption: Interruption) -> None:
        super().__init__()
        self._interruption = interruption

    def _on_step(self) -> bool:
        self._interruption.check()
        return True


class Evaluate(BaseCallback):
    """Every so many steps: episodes without action noise, checkpoints, one recording.

    Attributes:
        folder: Folder of the run.
    """

    def __init__(
        self,
        env: Env,
        folder: RunFolder,
        config: RunConfig,
        *,
        progress: Progress,
        interruption: Interruption,
    ) -> None:
        super().__init__()
        self._env, self.folder, self._config = env, folder, config
        self._progress, self._interruption = progress, interruption
        self._next = config.protocol.every
        self._best = (-1.0, -np.inf)

    def _on_step(self) -> bool:
        if self.num_timesteps >= self._next:
            self._next += self._config.protocol.every
            name = f"step{self.num_timesteps:08d}"
            self._report(self.evaluate(self._config.protocol.episodes, name))
        return True

    def evaluate(self, episodes: int, name: str) -> list[Trial]:
        """Run validation instances 0, 1, ...; store trials and the last checkpoint.

        Args:
            episodes: How many.
            name: Name for the recording of the last one.

        Raises:
            KeyboardInterrupt: If Ctrl-C was pressed.
        """
        save_model(self.model, self.folder.last)
        planner = PolicyPlanner(self.model, self._config.env.action_layer)
        task = self._progress.add_task("evaluation", total=episodes, rate="", success="")
        trials = []
        for instance in range(episodes):
            recorder = EpisodeRecorder()
            trial = self._episode(planner, instance, recorder)
            trials.append(trial)
            self._progress.advance(task)
        self._progress.remove_task(task)
        path = self.folder.recordings / f"{name}.rrd"
        save_recording(recorder, self._env, trial, split=_SPLIT, path=path)
        self._store(trials)
        return trials

    def _episode(self, planner: PolicyPlanner, instance: int, recorder: EpisodeRecorder) -> Trial:
        observers: list[Observer] = [
            self._interruption.check,
            lambda inner: recorder.add(inner.record),
        ]
        return run_episode(
            self._env,
            planner,
            method=self._config.algo,
            scene=self._config.env.scene,
            instance=instance,
            split=_SPLIT,
            observers=observers,
        )

    def _store(self, trials: Sequence[Trial]) -> None:
        new = not self.folder.evaluations.exists()
        with self.folder.evaluations.open("a", newline="") as file:
            names = ["step", *(field.name for field in fields(Trial))]
            writer = csv.DictWriter(file, names)
            if new:
                writer.writeheader()
            writer.writerows({"step": self.num_timesteps, **asdict(t)} for t in trials)

    def _report(self, trials: Sequence[Trial]) -> None:
        success = float(np.mean([trial.success for trial in trials]))
        returns = float(np.mean([trial.episode_return for trial in trials]))
        if (success, returns) > self._best:
            self._best = (success, returns)
            save_model(self.model, self.folder.best)
        self.logger.record("eval/success_rate", success)
        self.logger.record("eval/mean_return", returns)
        self.logger.dump(self.num_timesteps)
        self._progress.console.print(
            f"evaluation at step {self.num_timesteps}: success {success:.0%}, "
            f"return {returns:.1f}, outcomes {', '.join(trial.outcome for trial in trials)}"
        )
