"""DSAC-T, and the training loop of its whole family."""

from __future__ import annotations

from typing import Any, ClassVar, Final, TypeVar

import numpy as np
import torch as th
from gymnasium import spaces
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.noise import ActionNoise
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.type_aliases import (
    DictReplayBufferSamples,
    GymEnv,
    MaybeCallback,
    ReplayBufferSamples,
    Schedule,
)

from sb3_bayes_dsac.common.actors import Actor
from sb3_bayes_dsac.common.critics import GaussianCritics
from sb3_bayes_dsac.common.diagnostics import ScalarMeans
from sb3_bayes_dsac.common.gaussian import FUSIONS, Fused, weight_entropy
from sb3_bayes_dsac.common.losses import Target, clipped_share, critic_loss, track_mean_std
from sb3_bayes_dsac.common.policies import CnnPolicy, DSACPolicy, MlpPolicy, MultiInputPolicy
from sb3_bayes_dsac.common.temperature import parse_temperature
from sb3_bayes_dsac.errors import ArgumentError, choose

SelfDSACT = TypeVar("SelfDSACT", bound="DSACT")

# The noise of a sampled target return stays within so many deviations, as in DSAC-T.
NOISE_LIMIT: Final = 3.0


class DSACT(OffPolicyAlgorithm):
    """Distributional Soft Actor-Critic with Three Refinements (DSAC-T), on Stable-Baselines3.

    Paper: https://arxiv.org/abs/2310.05858, with its loss as printed there ("variant A" in
    `common.losses`). Critics learn the mean and the deviation of the return; a target actor, a
    delayed actor and delayed targets as in the authors' code.

    Arguments that are not listed are those of SB3's SAC, with the same defaults, so that a
    comparison with SAC compares the algorithms. The authors' code differs there: learning rate
    1e-4 (3e-4 for the entropy coefficient), nets of 3 x 256 GELU, 10,000 warm-up steps from the
    policy, entropy coefficient from e = 2.72, log deviation of the actor at most 0.5, one gradient
    step per 20 environment steps, and a log density in the units of the action, which shifts the
    target entropy. All but the last two follow from arguments of this class.

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
    policy: DSACPolicy
    actor: Actor
    actor_target: Actor
    critic: GaussianCritics
    critic_target: GaussianCritics

    def __init__(
        self,
        policy: str | type[DSACPolicy],
        env: GymEnv | str,
        learning_rate: float | Schedule = 3e-4,
        buffer_size: int = 1_000_000,
        learning_starts: int = 100,
        batch_size: int = 256,
        tau: float = 0.005,
        gamma: float = 0.99,
        train_freq: int | tuple[int, str] = 1,
        gradient_steps: int = 1,
        action_noise: ActionNoise | None = None,
        replay_buffer_class: type[ReplayBuffer] | None = None,
        replay_buffer_kwargs: dict[str, Any] | None = None,
        optimize_memory_usage: bool = False,
        n_steps: int = 1,
        ent_coef: str | float = "auto",
        policy_delay: int = 2,
        target_entropy: str | float = "auto",
        use_sde: bool = False,
        sde_sample_freq: int = -1,
        use_sde_at_warmup: bool = False,
        stats_window_size: int = 100,
        tensorboard_log: str | None = None,
        policy_kwargs: dict[str, Any] | None = None,
        verbose: int = 0,
        seed: int | None = None,
        device: th.device | str = "auto",
        _init_setup_model: bool = True,
        *,
        fusion: str | None = None,
        detach_fusion_weights: bool = False,
    ) -> None:
        super().__init__(
            policy,
            env,
            learning_rate,
            buffer_size,
            learning_starts,
            batch_size,
            tau,
            gamma,
            train_freq,
            gradient_steps,
            action_noise,
            replay_buffer_class=replay_buffer_class,
            replay_buffer_kwargs=replay_buffer_kwargs,
            optimize_memory_usage=optimize_memory_usage,
            n_steps=n_steps,
            policy_kwargs=policy_kwargs,
            stats_window_size=stats_window_size,
            tensorboard_log=tensorboard_log,
            verbose=verbose,
            device=device,
            support_multi_env=True,
            seed=seed,
            use_sde=use_sde,
            sde_sample_freq=sde_sample_freq,
            use_sde_at_warmup=use_sde_at_warmup,
        )
        self.ent_coef = ent_coef
        self.policy_delay = policy_delay
        self.target_entropy = target_entropy
        self.fusion = self.default_fusion if fusion is None else fusion
        self.detach_fusion_weights = detach_fusion_weights
        if _init_setup_model:
            self._setup_model()

    def _setup_model(self) -> None:
        """Check the arguments, create networks, buffer, entropy coefficient and statistics."""
        if not isinstance(self.action_space, spaces.Box):
            cure = "the actor is Gaussian; use an environment with a Box action space"
            raise ArgumentError("action_space", self.action_space, cure)
        if self.policy_delay < 1:
            raise ArgumentError("policy_delay", self.policy_delay, "give 1 or more")
        choose("fusion", self.fusion, FUSIONS)
        temperature = parse_temperature(self.ent_coef)
        super()._setup_model()
        self._create_aliases()
        if self.target_entropy == "auto":
            self.target_entropy = -float(np.prod(self.action_space.shape))
        self.log_ent_coef = th.tensor([temperature.initial], device=self.device).log()
        self.ent_coef_optimizer: th.optim.Optimizer | None = None
        if temperature.learned:
            self.log_ent_coef.requires_grad_()
            self.ent_coef_optimizer = th.optim.Adam(
                [self.log_ent_coef], lr=self.lr_schedule(1), fused=True
            )
        self.mean_std = th.zeros(self.critic.n_critics, device=self.device)

    def _create_aliases(self) -> None:
        """Short names of the policy's networks."""
        self.actor = self.policy.actor
        self.actor_target = self.policy.actor_target
        self.critic = self.policy.critic
        self.critic_target = self.policy.critic_target

    def fuse(self, means: th.Tensor, stds: th.Tensor) -> Fused:
        """The one rule by which n returns become one, for targets and for the actor.

        Args:
            means: Critics' means, shape (n, B).
            stds: Critics' standard deviations, shape (n, B).
        """
        return FUSIONS[self.fusion](means, stds)

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Sample the replay buffer and update, `gradient_steps` times."""
        self.policy.set_training_mode(True)
        optimizers = [self.critic.optimizer, self.actor.optimizer]
        if self.ent_coef_optimizer is not None:
            optimizers.append(self.ent_coef_optimizer)
        self._update_learning_rate(optimizers)
        scalars = ScalarMeans()
        assert self.replay_buffer is not None

        for _ in range(gradient_steps):
            self._n_updates += 1
            update_actor = self._n_updates % self.policy_delay == 0
            batch = self.replay_buffer.sample(batch_size, env=self._vec_normalize_env)
            self.actor.resample_noise()
            self.actor_target.resample_noise()

            # One pass of the online encoder, (B, features_dim), serves all losses of this step.
            features = self.critic.encode(batch.observations)
            loss = self._critic_loss(features, batch, scalars)
            if update_actor:
                loss = loss + self._actor_loss(features, batch, scalars)

            # All gradients come from the weights before the step, in one backward pass. No weight
            # belongs to two losses, except an encoder that is meant to learn from both.
            for optimizer in optimizers:
                optimizer.zero_grad()
            th.autograd.backward(loss)
            for optimizer in optimizers if update_actor else optimizers[:1]:
                optimizer.step()
            if update_actor:
                self.policy.update_targets(self.tau)

        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        for name, mean in scalars.read().items():
            self.logger.record(f"train/{name}", mean)

    def _critic_loss(
        self,
        features: th.Tensor,
        batch: ReplayBufferSamples | DictReplayBufferSamples,
        scalars: ScalarMeans,
    ) -> th.Tensor:
        """Loss of all critics on a batch; moves the running mean of sigma first."""
        target = self._target(batch, scalars)
        means, stds = self.critic.evaluate(self.policy.critic_features(features), batch.actions)
        track_mean_std(self.mean_std, stds, self.tau)
        loss = critic_loss(means, stds, target, self.mean_std)
        means, stds = means.detach(), stds.detach()
        scalars.add(
            critic_loss=loss,
            q_mean=means.mean(),
            q_gap=(means.amax(dim=0) - means.amin(dim=0)).mean(),
            sigma_mean=stds.mean(),
            clipped_share=clipped_share(means, target, self.mean_std),
        )
        return loss

    @th.no_grad()
    def _target(
        self, batch: ReplayBufferSamples | DictReplayBufferSamples, scalars: ScalarMeans
    ) -> Target:
        """Mean and one sample of the target return (T_q and T_z of the paper).

        The paper omits the factor 1 - done; time-outs are not done here, as SB3 stores them.
        With n-step replay the reward and the discount already span n steps.
        """
        actor_features, critic_features = self.policy.target_features(batch.next_observations)
        actions, log_prob = self.actor_target.sample(actor_features)
        fused = self.fuse(*self.critic_target.evaluate(critic_features, actions))
        discounts = self.gamma if batch.discounts is None else batch.discounts.flatten()
        weight = (1.0 - batch.dones.flatten()) * discounts
        # One noise for all critics: they share the sampled return.
        noise = th.randn_like(fused.std).clamp(-NOISE_LIMIT, NOISE_LIMIT)
        soft_value = fused.mean - self.log_ent_coef.exp() * log_prob
        mean = batch.rewards.flatten() + weight * soft_value
        scalars.add(
            sigma_fused=fused.std.mean(), fusion_weight_entropy=weight_entropy(fused.weights)
        )
        return Target(mean, mean + weight * fused.std * noise)

    def _actor_loss(
        self,
        features: th.Tensor,
        batch: ReplayBufferSamples | DictReplayBufferSamples,
        scalars: ScalarMeans,
    ) -> th.Tensor:
        """Loss of the actor (the paper's J_pi with its sign turned) and of the temperature."""
        actor_features = self.policy.actor_features(batch.observations, features)
        actions, log_prob = self.actor.sample(actor_features)
        ent_coef = self.log_ent_coef.detach().exp()
        value = self._actor_value(*self.critic.evaluate(features.detach(), actions, frozen=True))
        actor_loss = (ent_coef * log_prob - value).mean()
        scalars.add(ent_coef=ent_coef.squeeze(), actor_loss=actor_loss)
        if self.ent_coef_optimizer is None:
            return actor_loss
        surprise = (log_prob.detach() + float(self.target_entropy)).mean()
        ent_coef_loss = -(self.log_ent_coef * surprise).squeeze()
        scalars.add(ent_coef_loss=ent_coef_loss)
        return actor_loss + ent_coef_loss

    def _actor_value(self, means: th.Tensor, stds: th.Tensor) -> th.Tensor:
        """What the actor maximises besides entropy, shape (B,), from (n, B) each."""
        # The gradient reaches the weights through the deviations alone, whatever the rule.
        return self.fuse(means, stds.detach() if self.detach_fusion_weights else stds).mean

    def learn(
        self: SelfDSACT,
        total_timesteps: int,
        callback: MaybeCallback = None,
        log_interval: int = 4,
        tb_log_name: str | None = None,
        reset_num_timesteps: bool = True,
        progress_bar: bool = False,
    ) -> SelfDSACT:
        """Train; as in SB3, with the class name as default of `tb_log_name`."""
        return super().learn(
            total_timesteps,
            callback,
            log_interval,
            tb_log_name or type(self).__name__,
            reset_num_timesteps,
            progress_bar,
        )

    def _excluded_save_params(self) -> list[str]:
        """Attributes that come back with the policy."""
        aliases = ["actor", "actor_target", "critic", "critic_target"]
        return super()._excluded_save_params() + aliases

    def _get_torch_save_params(self) -> tuple[list[str], list[str]]:
        """State dicts and tensors that a saved model holds."""
        state_dicts = ["policy", "actor.optimizer", "critic.optimizer"]
        if self.ent_coef_optimizer is not None:
            state_dicts.append("ent_coef_optimizer")
        return state_dicts, ["log_ent_coef", "mean_std"]
