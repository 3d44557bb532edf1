"""DSAC-T: distributional soft actor-critic with three refinements."""

from __future__ import annotations

from typing import Any, ClassVar, Final

import torch as th
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.type_aliases import GymEnv, Schedule

from sb3_bayes_dsac.common.actors import Actor
from sb3_bayes_dsac.common.critics import GaussianCritics
from sb3_bayes_dsac.common.gaussian import FUSIONS, Fused, weight_entropy
from sb3_bayes_dsac.common.losses import (
    Target,
    clipped_share,
    critic_loss,
    negative_log_likelihood,
    track_mean_std,
)
from sb3_bayes_dsac.common.minibatches import Batch
from sb3_bayes_dsac.common.soft_actor_critic import SoftActorCritic
from sb3_bayes_dsac.dsac_t.policies import CnnPolicy, DSACPolicy, MlpPolicy, MultiInputPolicy
from sb3_bayes_dsac.errors import choose

# The noise of a sampled target return stays within so many deviations, as in DSAC-T.
NOISE_LIMIT: Final = 3.0


class DSACT(SoftActorCritic):
    """Distributional Soft Actor-Critic with Three Refinements (DSAC-T), on Stable-Baselines3.

    Paper: https://arxiv.org/abs/2310.05858, with its loss as printed there ("variant A" in
    `common.losses`). Critics learn the mean and the deviation of the return; a target actor, a
    delayed actor and delayed targets as in the authors' code.

    Arguments that are not listed are those of SB3's SAC, by keyword, with the same defaults, so
    that a comparison with SAC compares the algorithms. The authors' code differs there: learning
    rate 1e-4 (3e-4 for the entropy coefficient), nets of 3 x 256 GELU, 10,000 warm-up steps from
    the policy, entropy coefficient from e = 2.72, log deviation of the actor at most 0.5, one
    gradient step per 20 environment steps, and a log density in the units of the action, which
    shifts the target entropy. All but the last two follow from arguments of this class.

    Args:
        policy: "MlpPolicy", "CnnPolicy", "MultiInputPolicy" or a subclass of `DSACPolicy`.
        env: Environment or its registered name.
        policy_delay: Gradient steps per update of actor, entropy coefficient and all targets; it
            takes the place of SAC's `target_update_interval`. Counted over the whole training,
            also when `gradient_steps` is above 1. With the default 2, DSAC-T's, actor and targets
            move at half of SAC's rate; 1 learns sooner on a short budget.
        fusion: How the critics' returns become one: "min" (DSAC-T), "product" (Bayes-DSAC) or
            "log_pool"; None means the rule of the class, `default_fusion`. `fuse` may be
            overridden for others.
        detach_fusion_weights: Whether the actor's loss takes the weights of "product" and
            "log_pool" as constants. Without it actions also move towards those at which the
            critic with the higher mean is the surer one.

    Raises:
        ArgumentError: An argument that cannot work, with its name, value and cure.
    """

    policy_aliases: ClassVar[dict[str, type[BasePolicy]]] = {
        "MlpPolicy": MlpPolicy,
        "CnnPolicy": CnnPolicy,
        "MultiInputPolicy": MultiInputPolicy,
    }
    default_fusion: ClassVar[str] = "min"
    delays_targets: ClassVar[bool] = True
    policy: DSACPolicy
    actor_target: Actor
    critic: GaussianCritics
    critic_target: GaussianCritics

    def __init__(
        self,
        policy: str | type[DSACPolicy],
        env: GymEnv | str,
        learning_rate: float | Schedule = 3e-4,
        *,
        fusion: str | None = None,
        detach_fusion_weights: bool = False,
        **kwargs: Any,
    ) -> None:
        self.fusion = self.default_fusion if fusion is None else fusion
        self.detach_fusion_weights = detach_fusion_weights
        super().__init__(policy, env, learning_rate, **kwargs)

    def _setup_model(self) -> None:
        """Check the fusion, then create everything, the running mean of sigma last."""
        choose("fusion", self.fusion, FUSIONS)
        super()._setup_model()
        self.mean_std = th.zeros(self.critic.n_critics, device=self.device)

    def _create_aliases(self) -> None:
        """Short names of the policy's networks."""
        super()._create_aliases()
        self.actor_target = self.policy.actor_target

    def fuse(self, means: th.Tensor, stds: th.Tensor) -> Fused:
        """The one rule by which n returns become one, for targets and for the actor.

        Args:
            means: Critics' means, shape (n, B).
            stds: Critics' standard deviations, shape (n, B).
        """
        return FUSIONS[self.fusion](means, stds)

    def _actor_is_due(self, steps_left: int) -> bool:
        """Every `policy_delay` gradient steps, counted over the whole training."""
        return self._n_updates % self.policy_delay == 0

    def _resample_noise(self) -> None:
        """Draw gSDE noise anew, also that of the target actor."""
        super()._resample_noise()
        self.actor_target.resample_noise()

    def _critic_loss(self, features: th.Tensor, batch: Batch) -> th.Tensor:
        """Loss of all critics on a batch; moves the running mean of sigma first."""
        fused, target = self._target(batch)
        means, stds = self.critic.evaluate(features, batch.actions)
        track_mean_std(self.mean_std, stds, self.tau)
        loss = critic_loss(means, stds, target, self.mean_std)
        q, sigma = means.detach(), stds.detach()
        self._diagnostics.note("critics", self._report, q, sigma, *fused, *target)
        return loss

    def _report(
        self, q: th.Tensor, sigma: th.Tensor, *fused_and_target: th.Tensor
    ) -> dict[str, th.Tensor]:
        """What the logger says of the critics."""
        fused, target = Fused(*fused_and_target[:3]), Target(*fused_and_target[3:])
        return {
            "critic_loss": negative_log_likelihood(q, sigma, target).sum(),
            "q_mean": q.mean(dim=1),
            "q_gap": (q.amax(dim=0) - q.amin(dim=0)).mean(),
            "sigma_mean": sigma.mean(dim=1),
            "sigma_fused": fused.std.mean(),
            "fusion_weight_entropy": weight_entropy(fused.weights),
            "clipped_share": clipped_share(q, target, self.mean_std),
        }

    @th.no_grad()
    def _target(self, batch: Batch) -> tuple[Fused, Target]:
        """Fused return of the next state, and mean and one sample of the target return.

        T_q and T_z of the paper, which omits the factor 1 - done.
        """
        actor_features, critic_features = self.policy.next_features(batch.next_observations)
        actions, log_prob = self.actor_target.sample(actor_features)
        fused = self.fuse(*self.critic_target.evaluate(critic_features, actions))
        weight = self._continuation(batch)
        # One noise for all critics: they share the sampled return.
        noise = th.randn_like(fused.std).clamp(-NOISE_LIMIT, NOISE_LIMIT)
        soft_value = fused.mean - self.log_ent_coef.exp() * log_prob
        mean = batch.rewards.flatten() + weight * soft_value
        return fused, Target(mean, mean + weight * fused.std * noise)

    def _actor_value(self, features: th.Tensor, actions: th.Tensor) -> th.Tensor:
        """Fused mean, shape (B,)."""
        means, stds = self.critic.evaluate(features, actions, frozen=True)
        # The gradient reaches the weights through the deviations alone, whatever the rule.
        return self.fuse(means, stds.detach() if self.detach_fusion_weights else stds).mean

    def _excluded_save_params(self) -> list[str]:
        """Attributes that come back with the policy."""
        return [*super()._excluded_save_params(), "actor_target"]

    def _get_torch_save_params(self) -> tuple[list[str], list[str]]:
        """State dicts and tensors that a saved model holds."""
        state_dicts, tensors = super()._get_torch_save_params()
        return state_dicts, [*tensors, "mean_std"]
