"""REDQ: randomised ensembled double Q-learning."""

from __future__ import annotations

from typing import Any, ClassVar

import torch as th
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.type_aliases import GymEnv, Schedule

from sb3_bayes_dsac.common.minibatches import Batch
from sb3_bayes_dsac.common.soft_actor_critic import SoftActorCritic
from sb3_bayes_dsac.errors import ArgumentError, require_count
from sb3_bayes_dsac.redq.critics import MeanCritics
from sb3_bayes_dsac.redq.policies import CnnPolicy, MlpPolicy, MultiInputPolicy, REDQPolicy


class REDQ(SoftActorCritic):
    """Randomized Ensembled Double Q-Learning (REDQ), on Stable-Baselines3.

    Paper: https://arxiv.org/abs/2101.05982. Ten critics learn one target, the minimum over a
    random pair of target critics; the actor maximises the mean of all ten. In each call of
    `train`, that is for every `train_freq` environment steps, the critics and their targets take
    `gradient_steps` steps and the actor one.

    Arguments that are not listed are those of SB3's SAC, by keyword, with the same defaults. The
    authors' code differs there: 5,000 warm-up steps, Xavier weights, and a target entropy per task.

    Args:
        subset_size: Target critics in the minimum, drawn anew in each gradient step for the whole
            batch; the paper's M.
        gradient_steps: Gradient steps per call of `train`; with the default `train_freq=1` the
            replay ratio.
        policy_delay: Gradient steps per update of actor and entropy coefficient, counted within
            one call of `train`, whose last step always updates them.

    Raises:
        ArgumentError: An argument that cannot work, with its name, value and cure.
        UnsupportedSpaceError: Actions that are not a Box.
    """

    policy_aliases: ClassVar[dict[str, type[BasePolicy]]] = {
        "MlpPolicy": MlpPolicy,
        "CnnPolicy": CnnPolicy,
        "MultiInputPolicy": MultiInputPolicy,
    }
    delays_targets: ClassVar[bool] = False
    policy: REDQPolicy
    critic: MeanCritics
    critic_target: MeanCritics

    def __init__(
        self,
        policy: str | type[REDQPolicy],
        env: GymEnv | str,
        learning_rate: float | Schedule = 3e-4,
        *,
        subset_size: int = 2,
        gradient_steps: int = 20,
        policy_delay: int = 20,
        **kwargs: Any,
    ) -> None:
        self.subset_size = subset_size
        super().__init__(
            policy,
            env,
            learning_rate,
            gradient_steps=gradient_steps,
            policy_delay=policy_delay,
            **kwargs,
        )

    def _setup_model(self) -> None:
        """Create everything, then check the subset against the number of critics."""
        super()._setup_model()
        require_count("subset_size", self.subset_size)
        if self.subset_size > self.critic.n_critics:
            cure = f"give 1 to n_critics, which is {self.critic.n_critics}"
            raise ArgumentError("subset_size", self.subset_size, cure)

    def _actor_is_due(self, steps_left: int) -> bool:
        """Every `policy_delay` steps of a call of `train`, the last one always among them."""
        return steps_left % self.policy_delay == 0

    def _critic_loss(self, features: th.Tensor, batch: Batch) -> th.Tensor:
        """Squared error of each critic: mean over the batch, sum over the critics."""
        values = self.critic.evaluate(features, batch.actions)
        loss = (values - self._target(batch)).square().mean(dim=1).sum()
        self._diagnostics.note("critics", self._report, values.detach(), loss.detach())
        return loss

    @staticmethod
    def _report(q: th.Tensor, loss: th.Tensor) -> dict[str, th.Tensor]:
        """What the logger says of the critics."""
        gap = q.amax(dim=0) - q.amin(dim=0)
        return {"critic_loss": loss, "q_mean": q.mean(dim=1), "q_gap": gap.mean()}

    @th.no_grad()
    def _target(self, batch: Batch) -> th.Tensor:
        """Target of all critics, shape (B,), from the current actor and a random subset."""
        actor_features, critic_features = self.policy.next_features(batch.next_observations)
        actions, log_prob = self.actor.sample(actor_features)
        subset = th.randperm(self.critic.n_critics, device=self.device)[: self.subset_size]
        values = self.critic_target.evaluate_subset(critic_features, actions, subset)
        soft_value = values.amin(dim=0) - self.log_ent_coef.exp() * log_prob
        return batch.rewards.flatten() + self._continuation(batch) * soft_value

    def _actor_value(self, features: th.Tensor, actions: th.Tensor) -> th.Tensor:
        """Mean of all critics, shape (B,)."""
        return self.critic.evaluate(features, actions, frozen=True).mean(dim=0)
