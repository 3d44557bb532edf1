"""What is left to win: Bayes-DSAC's gradient step written out by hand, beside the package's own.

    python benchmarks/update_limit.py [--rounds 15] [--out FILE]

No autograd, no modules, no checks, no diagnostics: the arithmetic of `vectors_rr20` of
`update_speed.py` as a list of tensor operations, as it is and compiled by Inductor. Before anything
is timed, its gradients are compared with those of the package.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import torch as th
from circumstances import circumstances, write_json
from horf_cli.provenance import versions
from stable_baselines3 import SAC
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from torch.nn.functional import softplus
from update_speed import BATCH, CASES, make, milliseconds

from sb3_bayes_dsac import BayesDSAC
from sb3_bayes_dsac.common.losses import BOUND_FACTOR, EPSILON
from sb3_bayes_dsac.dsac_t.dsac_t import NOISE_LIMIT

STEPS = 20
DISCOUNT = 0.99
TAU = 0.005
SQUASHING_EPSILON = 1e-6


class Perceptrons(NamedTuple):
    """n perceptrons with two hidden layers; matrices (n, in, out), the last one (n, out, in)."""

    w1: th.Tensor
    b1: th.Tensor
    w2: th.Tensor
    b2: th.Tensor
    w3: th.Tensor
    b3: th.Tensor


class Layers(NamedTuple):
    """What a pass leaves: its input, both hidden layers, and the outputs (n, out, B)."""

    x: th.Tensor
    h1: th.Tensor
    h2: th.Tensor
    outputs: th.Tensor


class Sample(NamedTuple):
    """Actions (B, A), their log density (B,), and what its gradient needs."""

    actions: th.Tensor
    log_prob: th.Tensor
    slope: th.Tensor
    step: th.Tensor


def forward(nets: Perceptrons, x: th.Tensor) -> Layers:
    """All layers for x of shape (B, in)."""
    x = x.expand(len(nets.w1), -1, -1)
    h1 = th.baddbmm(nets.b1, x, nets.w1).relu_()
    h2 = th.baddbmm(nets.b2, h1, nets.w2).relu_()
    return Layers(x, h1, h2, th.baddbmm(nets.b3, nets.w3, h2.transpose(1, 2)))


def by_hidden(nets: Perceptrons, layers: Layers, by_outputs: th.Tensor) -> list[th.Tensor]:
    """Gradients of both hidden layers, before their activations."""
    by_h2 = th.bmm(by_outputs.transpose(1, 2), nets.w3) * (layers.h2 > 0)
    return [th.bmm(by_h2, nets.w2.transpose(1, 2)) * (layers.h1 > 0), by_h2]


def by_weights(nets: Perceptrons, layers: Layers, by_outputs: th.Tensor) -> Perceptrons:
    """Gradients of all weights."""
    by_h1, by_h2 = by_hidden(nets, layers, by_outputs)
    return Perceptrons(
        th.bmm(layers.x.transpose(1, 2), by_h1),
        by_h1.sum(dim=1, keepdim=True),
        th.bmm(layers.h1.transpose(1, 2), by_h2),
        by_h2.sum(dim=1, keepdim=True),
        th.bmm(by_outputs, layers.h2),
        by_outputs.sum(dim=2, keepdim=True),
    )


def sample(layers: Layers, noise: th.Tensor) -> Sample:
    """Squashed Gaussian actions."""
    mean, log_std = layers.outputs[0].t().chunk(2, dim=1)
    log_std = log_std.clamp(-20.0, 2.0)
    step = log_std.exp() * noise
    actions = (mean + step).tanh()
    slope = 1.0 - actions * actions
    density = (slope + SQUASHING_EPSILON).log() + log_std + 0.5 * noise * noise
    constant = 0.5 * np.log(2.0 * np.pi) * mean.shape[1]
    return Sample(actions, -density.sum(dim=1) - constant, slope, step)


def fuse(means: th.Tensor, stds: th.Tensor) -> tuple[th.Tensor, th.Tensor, th.Tensor]:
    """Product of the critics' densities: mean, deviation, weights."""
    precisions = 1.0 / (stds * stds)
    total = precisions.sum(dim=0)
    weights = precisions / total
    return (weights * means).sum(dim=0), total.rsqrt(), weights


def critic_gradients(
    actor_target: Perceptrons,
    critics: Perceptrons,
    critics_target: Perceptrons,
    mean_std: th.Tensor,
    ent_coef: th.Tensor,
    batch: tuple[th.Tensor, ...],
    noise: tuple[th.Tensor, th.Tensor],
) -> tuple[th.Tensor, Perceptrons]:
    """New running mean of sigma and gradients of the critics' weights."""
    obs, actions, next_obs, dones, rewards = batch
    following = sample(forward(actor_target, next_obs), noise[0])
    x = th.cat([next_obs, following.actions], dim=1)
    means, raw = forward(critics_target, x).outputs.unbind(dim=1)
    mean, std, _ = fuse(means, softplus(raw))
    weight = (1.0 - dones) * DISCOUNT
    target = rewards + weight * (mean - ent_coef * following.log_prob)
    drawn = target + weight * std * noise[1].clamp(-NOISE_LIMIT, NOISE_LIMIT)

    layers = forward(critics, th.cat([obs, actions], dim=1))
    means, raw = layers.outputs.unbind(dim=1)
    stds = softplus(raw)
    batch_mean = stds.mean(dim=1)
    mean_std = th.where(mean_std == 0.0, batch_mean, th.lerp(mean_std, batch_mean, TAU))
    bound = BOUND_FACTOR * mean_std[:, None]
    error = th.maximum(th.minimum(drawn - means, bound), -bound)
    variance = stds * stds
    scale = (mean_std * mean_std + EPSILON)[:, None] / -len(obs)
    by_mean = (target - means) / (variance + EPSILON) * scale
    by_std = (error * error - variance) / (variance * stds + EPSILON) * scale
    by_outputs = th.stack([by_mean, by_std * raw.sigmoid()], dim=1)
    return mean_std, by_weights(critics, layers, by_outputs)


def actor_gradients(
    actor: Perceptrons,
    critics: Perceptrons,
    ent_coef: th.Tensor,
    obs: th.Tensor,
    noise: th.Tensor,
) -> tuple[th.Tensor, Perceptrons]:
    """Mean log density and gradients of the actor's weights."""
    n, width = len(obs), obs.shape[1]
    layers = forward(actor, obs)
    drawn = sample(layers, noise)
    judged = forward(critics, th.cat([obs, drawn.actions], dim=1))
    means, raw = judged.outputs.unbind(dim=1)
    stds = softplus(raw)
    mean, _, weights = fuse(means, stds)
    by_std = weights * (means - mean) / stds * (2.0 / n)
    by_outputs = th.stack([weights / -n, by_std * raw.sigmoid()], dim=1)
    by_h1, _ = by_hidden(critics, judged, by_outputs)
    by_action = th.bmm(by_h1, critics.w1[:, width:].transpose(1, 2)).sum(dim=0)

    by_log_prob = ent_coef / n
    squashing = 2.0 * drawn.actions / (drawn.slope + SQUASHING_EPSILON)
    by_raw = (by_action + squashing * by_log_prob) * drawn.slope
    by_heads = th.cat([by_raw, by_raw * drawn.step - by_log_prob], dim=1)
    return drawn.log_prob.mean(), by_weights(actor, layers, by_heads.t()[None])


class Adam:
    """PyTorch's fused kernel with SB3's options."""

    def __init__(self, weights: tuple[th.Tensor, ...]) -> None:
        self._weights = list(weights)
        self._averages = [[th.zeros_like(w) for w in weights] for _ in range(2)]
        self._steps = [th.zeros(()) for _ in weights]

    def __call__(self, gradients: tuple[th.Tensor, ...]) -> None:
        """One step."""
        th._foreach_add_(self._steps, 1.0)
        th._fused_adam_(
            self._weights,
            list(gradients),
            self._averages[0],
            self._averages[1],
            [],
            self._steps,
            lr=3e-4,
            beta1=0.9,
            beta2=0.999,
            weight_decay=0.0,
            eps=1e-8,
            amsgrad=False,
            maximize=False,
        )


class HandWritten:
    """The networks of a model and a training loop that does what `train` must, and no more."""

    def __init__(self, model: BayesDSAC, wrap: Callable[[Any], Any]) -> None:
        self._model = model
        self._critic_gradients = wrap(critic_gradients)
        self._actor_gradients = wrap(actor_gradients)
        self.actor, self.actor_target = actor_of(model.actor), actor_of(model.actor_target)
        self.critics = critics_of(model.critic)
        self.critics_target = critics_of(model.critic_target)
        self.mean_std = model.mean_std.clone()
        self.log_ent_coef = model.log_ent_coef.detach().clone()
        self._descend_actor = Adam(self.actor)
        self._descend_critics = Adam(self.critics)
        self._descend_ent_coef = Adam((self.log_ent_coef,))

    @th.no_grad()
    def train(self, batches: list[tuple[th.Tensor, ...]]) -> None:
        """One gradient step a batch, each second one of the actor, too."""
        for k, batch in enumerate(batches):
            by_critics = self.critic_step(batch)
            if not by_critics.b3.sum().isfinite().item():
                raise ArithmeticError("the critics' gradient is not finite; start anew")
            if k % 2:
                self._actor_step(batch[0])
            self._descend_critics(by_critics)
            if k % 2:
                targets = [*self.actor_target, *self.critics_target]
                th._foreach_lerp_(targets, [*self.actor, *self.critics], TAU)

    def critic_step(self, batch: tuple[th.Tensor, ...]) -> Perceptrons:
        """Move the running mean of sigma; gradients of the critics."""
        noise = (th.randn_like(batch[1]), th.randn_like(batch[4]))
        nets = (self.actor_target, self.critics, self.critics_target)
        self.mean_std, gradients = self._critic_gradients(
            *nets, self.mean_std, self.log_ent_coef.exp(), batch, noise
        )
        return cast("Perceptrons", gradients)

    def actor_step(self, obs: th.Tensor) -> tuple[th.Tensor, Perceptrons]:
        """Mean log density and gradients of the actor."""
        noise = th.randn(len(obs), self.actor.b3.shape[1] // 2)
        found = self._actor_gradients(self.actor, self.critics, self.log_ent_coef.exp(), obs, noise)
        return cast("tuple[th.Tensor, Perceptrons]", found)

    def _actor_step(self, obs: th.Tensor) -> None:
        log_prob, gradients = self.actor_step(obs)
        surprise = log_prob + float(self._model.target_entropy)
        self._descend_ent_coef((-surprise[None],))
        self._descend_actor(gradients)


def critics_of(critic: Any) -> Perceptrons:
    """Copies of the critics' weights."""
    return Perceptrons(*(weight.detach().clone() for weight in critic.ensemble.parameters()))


def actor_of(actor: Any) -> Perceptrons:
    """Copies of an actor's weights, as an ensemble of one; both heads in one matrix."""
    first, second = actor.latent_pi[0], actor.latent_pi[2]
    heads = th.cat([actor.mu.weight, actor.log_std.weight])
    biases = th.cat([actor.mu.bias, actor.log_std.bias])
    weights = (first.weight.t(), first.bias[None], second.weight.t(), second.bias[None])
    return Perceptrons(*(w.detach()[None].clone() for w in (*weights, heads, biases[:, None])))


def batches_of(model: BayesDSAC, n: int) -> list[tuple[th.Tensor, ...]]:
    """Batches as `train` draws them, at once: observations, actions, next ones, ends, rewards."""
    assert model.replay_buffer is not None
    drawn = model.replay_buffer.sample(BATCH * n)
    parts = (drawn.observations, drawn.actions, drawn.next_observations)
    flat = (drawn.dones.flatten(), drawn.rewards.flatten())
    return list(zip(*(th.split(part, BATCH) for part in (*parts, *flat)), strict=True))


def train(hand: HandWritten, model: BayesDSAC) -> None:
    """What `model.train` does, with sampling."""
    hand.train(batches_of(model, STEPS))


def check(model: BayesDSAC) -> None:
    """Compare the gradients with the package's, from the same weights, batch and noise."""
    hand = HandWritten(model, lambda function: function)
    (batch,) = batches_of(model, 1)
    obs, actions, next_obs, dones, rewards = batch
    theirs = ReplayBufferSamples(obs, actions, next_obs, dones[:, None], rewards[:, None])
    with th.random.fork_rng():
        th.manual_seed(0)
        th.autograd.backward(model._critic_loss(obs, theirs))
        th.autograd.backward(model._actor_losses(obs, theirs)["actor_loss"])
        th.manual_seed(0)
        with th.no_grad():
            by_critics, (_, by_actor) = hand.critic_step(batch), hand.actor_step(obs)
    actor: Any = model.actor
    heads = th.cat([actor.mu.weight.grad, actor.log_std.weight.grad])
    references = [*(w.grad for w in model.critic.ensemble.parameters()), heads]
    for ours, reference in zip([*by_critics, by_actor.w3[0]], references, strict=True):
        th.testing.assert_close(ours, reference, rtol=1e-4, atol=1e-6)


def main() -> None:
    """Check, measure and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results/update_limit.json"))
    arguments = parser.parse_args()
    th.set_num_threads(1)
    case = CASES["vectors_rr20"]
    model, sac = make(BayesDSAC, case), make(SAC, case)
    check(make(BayesDSAC, case))
    compiled = partial(th.compile, dynamic=False, options={"cpp_wrapper": True})
    hand = {"by_hand": HandWritten(model, lambda function: function)}
    hand["by_hand_compiled"] = HandWritten(model, compiled)
    work: dict[str, Callable[[], object]] = {
        "sac": partial(sac.train, STEPS, BATCH),
        "bayes_dsac": partial(model.train, STEPS, BATCH),
        **{name: partial(train, written, model) for name, written in hand.items()},
    }
    begin = time.monotonic()
    work["by_hand_compiled"]()
    start_up = time.monotonic() - begin
    for run in work.values():
        run()
    rows = [
        {name: milliseconds(run, STEPS) for name, run in work.items()}
        for _ in range(arguments.rounds)
    ]
    result = {
        **circumstances(),
        "versions": versions(),
        "threads": th.get_num_threads(),
        "rounds": arguments.rounds,
        "compilation_s": start_up,
        "median_ms": {name: float(np.median([row[name] for row in rows])) for name in work},
        "ratio_to_sac": {
            name: float(np.median([row[name] / row["sac"] for row in rows])) for name in work
        },
    }
    write_json(result, arguments.out)
    print(json.dumps(result, indent=2))


if __name__ == "__main__":
    main()
