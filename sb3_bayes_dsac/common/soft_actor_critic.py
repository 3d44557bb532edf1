"""The training loop that all algorithms of this package share."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar, Self

import torch as th
from gymnasium import spaces
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.noise import ActionNoise
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.type_aliases import (
    GymEnv,
    MaybeCallback,
    Schedule,
)
from stable_baselines3.common.utils import update_learning_rate

from sb3_bayes_dsac.common.actors import Actor
from sb3_bayes_dsac.common.compiled import Compiled, require_compilable
from sb3_bayes_dsac.common.critics import EnsembleCritics
from sb3_bayes_dsac.common.diagnostics import Diagnostics
from sb3_bayes_dsac.common.fused_adam import FusedAdam
from sb3_bayes_dsac.common.guard import check_losses
from sb3_bayes_dsac.common.minibatches import Batch, minibatches
from sb3_bayes_dsac.common.policies import EnsemblePolicy
from sb3_bayes_dsac.common.temperature import parse_target_entropy, parse_temperature
from sb3_bayes_dsac.errors import UnsupportedSpaceError, require_count


def weights_of(optimizers: list[th.optim.Optimizer]) -> list[th.Tensor]:
    """What some optimisers move."""
    groups = [group for optimizer in optimizers for group in optimizer.param_groups]
    return [weight for group in groups for weight in group["params"]]


def forget_gradients(optimizers: list[th.optim.Optimizer]) -> None:
    """What `zero_grad` of each does, at a tenth of its cost: it has hooks that nobody uses."""
    for weight in weights_of(optimizers):
        weight.grad = None


class SoftActorCritic(OffPolicyAlgorithm):
    """Soft actor-critic with batched critics; a subclass says what they learn from.

    A subclass gives the critics' loss, what the actor maximises, and when the actor and the
    targets move. Arguments that are not listed are those of SB3's SAC, with the same defaults.

    Args:
        policy: "MlpPolicy", "CnnPolicy", "MultiInputPolicy" or a subclass of `EnsemblePolicy`.
        env: Environment or its registered name.
        policy_delay: Gradient steps per update of actor and entropy coefficient; each subclass
            says how it counts them.
        compile_updates: Whether losses and gradients are compiled by Inductor. It needs a C++
            compiler and half a minute when training begins, and takes a third off a step with
            vectors; numbers differ by rounding. What `train` reads besides weights, statistics and
            batches (gamma, tau, the target entropy) counts as it is when training begins.

    Raises:
        ArgumentError: An argument that cannot work, with its name, value and cure.
        UnsupportedSpaceError: Actions that are not a Box.
    """

    # Whether targets wait for the actor's update, or move in every gradient step.
    delays_targets: ClassVar[bool]
    policy: EnsemblePolicy
    actor: Actor
    critic: EnsembleCritics
    critic_target: EnsembleCritics

    def __init__(
        self,
        policy: str | type[EnsemblePolicy],
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
        compile_updates: bool = False,
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
        self.compile_updates = compile_updates
        self._compiled: dict[tuple[bool, int], Compiled] = {}
        self._diagnostics = Diagnostics()
        if _init_setup_model:
            self._setup_model()

    def _setup_model(self) -> None:
        """Check the arguments, create networks, buffer and entropy coefficient."""
        if not isinstance(self.action_space, spaces.Box):
            cure = "the actor is Gaussian; use an environment with a Box action space"
            raise UnsupportedSpaceError("action_space", self.action_space, cure)
        require_count("policy_delay", self.policy_delay)
        require_count("batch_size", self.batch_size)
        if self.compile_updates:
            require_compilable(use_sde=self.use_sde)
        temperature = parse_temperature(self.ent_coef)
        self.target_entropy = parse_target_entropy(self.target_entropy, self.action_space)
        super()._setup_model()
        self._create_aliases()
        self.log_ent_coef = th.tensor([temperature.initial], device=self.device).log()
        self.ent_coef_optimizer: th.optim.Optimizer | None = None
        if temperature.learned:
            self.log_ent_coef.requires_grad_()
            self.ent_coef_optimizer = FusedAdam([self.log_ent_coef], lr=self.lr_schedule(1))

    def _create_aliases(self) -> None:
        """Short names of the policy's networks."""
        self.actor = self.policy.actor
        self.critic = self.policy.critic
        self.critic_target = self.policy.critic_target

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Sample the replay buffer and update, `gradient_steps` times.

        Raises:
            NotFiniteError: A loss is NaN or infinite. Weights, optimisers and the entropy
                coefficient are those of the step before; only statistics of batch norm, if an
                encoder has any, have seen the batch.
        """
        self.policy.set_training_mode(True)
        self._update_learning_rate(self._optimizers(update_actor=True))
        assert self.replay_buffer is not None
        batches = minibatches(
            self.replay_buffer, batch_size, gradient_steps, self._vec_normalize_env
        )

        for steps_left, batch in zip(reversed(range(gradient_steps)), batches, strict=True):
            self._n_updates += 1
            update_actor = self._actor_is_due(steps_left)
            self._resample_noise()

            due = self._optimizers(update_actor=update_actor)
            forget_gradients(due)
            losses = self._differentiation(batch, update_actor=update_actor)(batch)
            check_losses(losses, batch, self._n_updates)
            for optimizer in due:
                optimizer.step()
            if update_actor or not self.delays_targets:
                self.policy.update_targets(self.tau)

        self._logger.record("train/n_updates", self._n_updates, exclude="tensorboard")

    def _optimizers(self, *, update_actor: bool) -> list[th.optim.Optimizer]:
        """Those that a gradient step uses."""
        if not update_actor:
            return [self.critic.optimizer]
        temperature = [self.ent_coef_optimizer] if self.ent_coef_optimizer is not None else []
        return [self.critic.optimizer, self.actor.optimizer, *temperature]

    def _differentiation(
        self, batch: Batch, *, update_actor: bool
    ) -> Callable[[Batch], dict[str, th.Tensor]]:
        """`_differentiate` as it is or compiled, for this kind of step and this size of batch."""
        differentiate = partial(self._differentiate, update_actor=update_actor)
        if not self.compile_updates:
            return differentiate
        kind = (update_actor, len(batch.rewards))
        if kind not in self._compiled:
            weights = weights_of(self._optimizers(update_actor=update_actor))
            self._compiled[kind] = Compiled(differentiate, weights, self._diagnostics)
        return self._compiled[kind]

    def _differentiate(self, batch: Batch, *, update_actor: bool) -> dict[str, th.Tensor]:
        """Losses of a batch; leaves the gradients of all weights that the step moves.

        All gradients come from the weights before the step, in one backward pass. No weight
        belongs to two losses, except an encoder that is meant to learn from both.
        """
        # One pass of the online encoder, (B, features_dim), serves all losses of this step.
        features = self.critic.encode(batch.observations)
        losses = {"critic_loss": self._critic_loss(self.policy.critic_features(features), batch)}
        if update_actor:
            losses |= self._actor_losses(features, batch)
        th.autograd.backward(th.stack(list(losses.values())).sum())
        return losses

    @property
    def logger(self) -> Logger:
        """SB3's logger with the newest diagnostics, which are computed when somebody asks for it.

        Few calls of `train` are followed by a look at the logger, and what it would show costs as
        much as a layer of the critics. `train` itself uses `_logger`, lest it be the one who looks.
        """
        logger = super().logger
        for name, value in self._diagnostics.read().items():
            logger.record(f"train/{name}", value)
        return logger

    def _update_learning_rate(
        self, optimizers: list[th.optim.Optimizer] | th.optim.Optimizer
    ) -> None:
        """As SB3 does it, without a look at `logger`."""
        rate = self.lr_schedule(self._current_progress_remaining)
        self._logger.record("train/learning_rate", rate)
        for optimizer in optimizers if isinstance(optimizers, list) else [optimizers]:
            update_learning_rate(optimizer, rate)

    def _resample_noise(self) -> None:
        """Draw the actors' gSDE noise anew."""
        self.actor.resample_noise()

    @abstractmethod
    def _actor_is_due(self, steps_left: int) -> bool:
        """Whether this gradient step updates the actor too.

        Args:
            steps_left: Gradient steps that still follow in this call of `train`.
        """

    @abstractmethod
    def _critic_loss(self, features: th.Tensor, batch: Batch) -> th.Tensor:
        """Loss of all critics on a batch.

        Args:
            features: Encoded observations, shape (B, features_dim), with gradient if the critics
                train the encoder.
            batch: Transitions.
        """

    @abstractmethod
    def _actor_value(self, features: th.Tensor, actions: th.Tensor) -> th.Tensor:
        """What the actor maximises besides entropy, shape (B,), with the critics frozen."""

    def _continuation(self, batch: Batch) -> th.Tensor:
        """Weight of the value that follows each transition, shape (B,): 0 after a terminal one.

        Time-outs are not terminal, as SB3 stores them. With n-step replay the discount spans n
        steps, as the reward does.
        """
        discounts = self.gamma if batch.discounts is None else batch.discounts.flatten()
        return (1.0 - batch.dones.flatten()) * discounts

    def _actor_losses(self, features: th.Tensor, batch: Batch) -> dict[str, th.Tensor]:
        """Loss of the actor (the paper's J_pi with its sign turned) and of the temperature."""
        actor_features = self.policy.actor_features(batch.observations, features)
        actions, log_prob = self.actor.sample(actor_features)
        ent_coef = self.log_ent_coef.detach().exp()
        value = self._actor_value(features.detach(), actions)
        losses = {"actor_loss": (ent_coef * log_prob - value).mean()}
        if self.ent_coef_optimizer is not None:
            surprise = log_prob.detach().mean() + float(self.target_entropy)
            losses["ent_coef_loss"] = -(self.log_ent_coef * surprise).squeeze()
        names = [*losses, "ent_coef"]
        values = [loss.detach() for loss in losses.values()]
        self._diagnostics.note(
            "actor", lambda *v: dict(zip(names, v, strict=True)), *values, ent_coef.squeeze()
        )
        return losses

    def learn(
        self,
        total_timesteps: int,
        callback: MaybeCallback = None,
        log_interval: int = 4,
        tb_log_name: str | None = None,
        reset_num_timesteps: bool = True,
        progress_bar: bool = False,
    ) -> Self:
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
        """Attributes that come back with the policy, or not at all."""
        own = ("actor", "critic", "critic_target", "_diagnostics", "_compiled")
        return [*super()._excluded_save_params(), *own]

    def _get_torch_save_params(self) -> tuple[list[str], list[str]]:
        """State dicts and tensors that a saved model holds."""
        state_dicts = ["policy", "actor.optimizer", "critic.optimizer"]
        if self.ent_coef_optimizer is not None:
            state_dicts.append("ent_coef_optimizer")
        return state_dicts, ["log_ent_coef"]
