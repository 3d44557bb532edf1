"""DAgger: imitation of a teacher in the states that the learner meets."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import torch as th
from stable_baselines3.common.noise import ActionNoise
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.type_aliases import GymEnv
from stable_baselines3.common.utils import LinearSchedule
from torch.nn import functional

from sb3_bayes_dsac.bayes_dsac.bayes_dsac import BayesDSAC
from sb3_bayes_dsac.common.guard import check_losses
from sb3_bayes_dsac.common.minibatches import minibatches
from sb3_bayes_dsac.common.policies import EnsemblePolicy
from sb3_bayes_dsac.common.taught_buffer import TaughtReplayBuffer, TaughtSamples
from sb3_bayes_dsac.dsac_t.policies import MultiInputPolicy
from sb3_bayes_dsac.errors import ArgumentError

# The actor's deviation is drawn to this, so that an algorithm that goes on from here with noise
# stays near to what was learnt.
_SPREAD, _SPREAD_WEIGHT = 0.1, 0.01
_LAST_RATE = 0.02  # of the first learning rate


class DAgger(BayesDSAC):
    """Dataset aggregation (Ross, Gordon, Bagnell 2011), on Stable-Baselines3.

    Not in the paper. The environment lets teacher and learner act in turns and tells what the
    teacher would have done (see `TaughtReplayBuffer`); the actor learns that by least squares. The
    policy is Bayes-DSAC's, so that Bayes-DSAC can go on from it; its critics stay as they are.

    Args:
        policy: "MultiInputPolicy".
        env: Environment whose `info` has the teacher's and the taken action.
        learning_rate: The first one; it falls linearly to a fiftieth.
        **kwargs: Of `BayesDSAC`.

    Raises:
        ArgumentError: A buffer that keeps no teacher's actions.
    """

    policy_aliases: ClassVar[dict[str, type[BasePolicy]]] = {"MultiInputPolicy": MultiInputPolicy}

    def __init__(
        self,
        policy: str | type[EnsemblePolicy],
        env: GymEnv | str,
        learning_rate: float = 5e-4,
        *,
        policy_kwargs: dict[str, Any] | None = None,
        replay_buffer_class: type[TaughtReplayBuffer] = TaughtReplayBuffer,
        **kwargs: Any,
    ) -> None:
        if not issubclass(replay_buffer_class, TaughtReplayBuffer):
            cure = "give TaughtReplayBuffer or a subclass"
            raise ArgumentError("replay_buffer_class", replay_buffer_class, cure)
        super().__init__(
            policy,  # type: ignore[arg-type]
            env,
            LinearSchedule(learning_rate, _LAST_RATE * learning_rate, 1.0),
            # The encoder has no other loss to learn from.
            policy_kwargs={**(policy_kwargs or {}), "encoder_gradient": "actor"},
            replay_buffer_class=replay_buffer_class,
            **kwargs,
        )

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Sample the replay buffer and imitate, `gradient_steps` times.

        Raises:
            NotFiniteError: The loss is NaN or infinite.
        """
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.actor.optimizer)
        assert self.replay_buffer is not None
        batches = minibatches(
            self.replay_buffer, batch_size, gradient_steps, self._vec_normalize_env
        )
        losses: dict[str, th.Tensor] = {}
        for batch in batches:
            assert isinstance(batch, TaughtSamples)
            self._n_updates += 1
            losses = self._imitation_losses(batch)
            check_losses(losses, batch, self._n_updates)
            self.actor.optimizer.zero_grad()
            th.stack(list(losses.values())).sum().backward()
            self.actor.optimizer.step()
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        for name, loss in losses.items():
            self.logger.record(f"train/{name}", loss.item())

    def _imitation_losses(self, batch: TaughtSamples) -> dict[str, th.Tensor]:
        mean, log_std, _ = self.actor.get_action_dist_params(batch.observations)
        spread = (log_std - np.log(_SPREAD)).square().mean()
        return {
            "imitation_loss": functional.mse_loss(th.tanh(mean), batch.teacher_actions),
            "spread_loss": _SPREAD_WEIGHT * spread,
        }

    def _sample_action(
        self, learning_starts: int, action_noise: ActionNoise | None = None, n_envs: int = 1
    ) -> tuple[np.ndarray, np.ndarray]:
        """The mean action: the learner shall meet the states that it will meet later."""
        assert self._last_obs is not None
        action, _ = self.predict(self._last_obs, deterministic=True)
        return action, self.policy.scale_action(action)
