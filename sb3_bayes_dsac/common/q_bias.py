"""Bias of a critic: what it predicts against what the policy then collects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import torch as th
from numpy.typing import NDArray
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.type_aliases import PyTorchObs

from sb3_bayes_dsac.common.critics import GaussianCritics
from sb3_bayes_dsac.errors import ArgumentError


@dataclass(frozen=True)
class QBias:
    """Predicted minus Monte-Carlo soft return over visited state-action pairs.

    Attributes:
        mean: Mean of the bias, in units of return.
        std: Standard deviation of the bias over the pairs, in units of return.
        normalized_mean: `mean` over the absolute value of the mean Monte-Carlo return, as in REDQ.
        normalized_std: `std` over the same.
        q_mean: Mean predicted return.
        return_mean: Mean Monte-Carlo soft return.
        sigma_mean: Mean standard deviation that the critics state; None if they state none.
        n_pairs: State-action pairs that these numbers rest on.
    """

    mean: float
    std: float
    normalized_mean: float
    normalized_std: float
    q_mean: float
    return_mean: float
    sigma_mean: float | None
    n_pairs: int


class _Step(NamedTuple):
    """One step of a rollout: what came of it, and what the critics said before."""

    reward: float
    entropy: float
    predicted: float
    sigma: float | None


def estimate_q_bias(
    model: OffPolicyAlgorithm,
    env: gym.Env[Any, Any],
    *,
    n_episodes: int = 10,
    tail: float = 0.05,
    seed: int = 0,
) -> QBias:
    """Roll the policy out and compare each prediction with the discounted return that followed.

    The policy acts as the critics assume: stochastic with entropy in the return (SAC, TQC and the
    algorithms of this package; the entropy of the first action is not part of Q), or deterministic
    (TD3, DDPG). A prediction is the mean over all critics and quantiles, as in REDQ's evaluation,
    for every algorithm alike.

    An episode that ends by time-out hides the rest of its returns. A pair counts only if the
    hidden part has at most the weight `tail`, that is if gamma^k <= tail for the k steps between
    it and the time-out: 299 steps with the defaults and gamma = 0.99. Pairs of episodes that end
    in a terminal state all count.

    With a model that was trained in a `VecNormalize`, observations and rewards are normalised by
    its statistics.

    Args:
        model: SAC, TQC, TD3, DDPG or an algorithm of this package.
        env: Environment of its own, so that the training is not disturbed.
        n_episodes: Episodes to roll out.
        tail: Largest weight of a return's hidden part, in (0, 1).
        seed: First episode's seed; the next episodes have the next seeds. Actions come from
            PyTorch's global generator.

    Raises:
        ArgumentError: No pair is left, because all episodes time out too early.
    """
    returns: list[float] = []
    counted: list[_Step] = []
    for k in range(n_episodes):
        steps, terminated = _roll_out(model, env, seed + k)
        hidden = model.gamma ** np.arange(len(steps), 0, -1) * (not terminated)
        n_known = int((hidden <= tail).sum())
        rewards, entropies = np.array([(step.reward, step.entropy) for step in steps]).T
        returns.extend(soft_returns(rewards, entropies, model.gamma)[:n_known])
        counted.extend(steps[:n_known])
    if not counted:
        cure = "time-outs hide all returns; give an env with longer episodes (max_episode_steps)"
        raise ArgumentError("env", env, cure)
    return _summarize(counted, np.array(returns))


def _summarize(steps: list[_Step], returns: NDArray[np.float64]) -> QBias:
    """Statistics of the pairs that count."""
    predicted = np.array([step.predicted for step in steps])
    sigmas = [step.sigma for step in steps if step.sigma is not None]
    bias, scale = predicted - returns, abs(returns.mean())
    return QBias(
        mean=float(bias.mean()),
        std=float(bias.std()),
        normalized_mean=float(bias.mean() / scale),
        normalized_std=float(bias.std() / scale),
        q_mean=float(predicted.mean()),
        return_mean=float(returns.mean()),
        sigma_mean=float(np.mean(sigmas)) if sigmas else None,
        n_pairs=len(steps),
    )


@th.no_grad()
def _roll_out(
    model: OffPolicyAlgorithm, env: gym.Env[Any, Any], seed: int
) -> tuple[list[_Step], bool]:
    """Steps of one episode, and whether it ended in a terminal state."""
    normalizer = model.get_vec_normalize_env()
    model.policy.set_training_mode(False)
    observation, _ = env.reset(seed=seed)
    steps: list[_Step] = []
    terminated = truncated = False
    while not (terminated or truncated):
        if normalizer is not None:
            observation = normalizer.normalize_obs(observation)
        tensors, _ = model.policy.obs_to_tensor(observation)
        action, entropy = _act(model, tensors)
        predicted, sigma = _predict(model, tensors, action)
        command = model.policy.unscale_action(action.cpu().numpy()[0])
        observation, reward, terminated, truncated, _ = env.step(command)
        if normalizer is not None:
            reward = normalizer.normalize_reward(np.array(reward))
        steps.append(_Step(float(reward), entropy, predicted, sigma))
    return steps, terminated


def soft_returns(
    rewards: NDArray[np.float64], entropies: NDArray[np.float64], gamma: float
) -> NDArray[np.float64]:
    """Discounted returns G_t = r_t + gamma (h_{t+1} + G_{t+1}) of one episode, shape (T,).

    Args:
        rewards: Reward of each step, shape (T,).
        entropies: Entropy bonus h_t = -alpha log pi(a_t | s_t) of each action, shape (T,).
        gamma: Discount factor.
    """
    returns = np.zeros(len(rewards))
    following = 0.0
    for t in reversed(range(len(rewards))):
        returns[t] = rewards[t] + gamma * following
        following = entropies[t] + returns[t]
    return returns


def _act(model: Any, observation: PyTorchObs) -> tuple[th.Tensor, float]:
    """Action in [-1, 1] of shape (1, action_dim), and its entropy bonus -alpha log pi."""
    if not hasattr(model.actor, "action_log_prob"):
        return model.actor(observation), 0.0
    action, log_prob = model.actor.action_log_prob(observation)
    learned = getattr(model, "log_ent_coef", None)
    ent_coef = model.ent_coef_tensor if learned is None else learned.exp()
    return action, -(ent_coef * log_prob).item()


def _predict(model: Any, observation: PyTorchObs, action: th.Tensor) -> tuple[float, float | None]:
    """Mean return over all critics and quantiles, and the mean deviation if they state one."""
    returns = model.critic(observation, action)
    if isinstance(model.critic, GaussianCritics):
        means, stds = returns
        return means.mean().item(), stds.mean().item()
    # SB3's critics answer with a tuple, TQC's and REDQ's with one tensor.
    return (th.stack(returns) if isinstance(returns, tuple) else returns).mean().item(), None
