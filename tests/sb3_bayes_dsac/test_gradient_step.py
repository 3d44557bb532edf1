"""One whole gradient step against an independent float64 transcription of the formulas.

Plain gradient descent with learning rate 1 turns the change of each weight into its gradient.
The transcription evaluates every network on its own, layer by layer.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch as th

from sb3_bayes_dsac import REDQ
from sb3_bayes_dsac.common.critics import GaussianCritics

MakeModel = Callable[..., Any]
Fill = Callable[[Any, int], None]
Weights = dict[str, th.Tensor]
Returns = list[tuple[th.Tensor, th.Tensor]]

GAMMA, TAU, ALPHA, BATCH = 0.9, 0.1, 0.3, 48


def doubles(module: th.nn.Module) -> Weights:
    """Weights of a module as float64 leaves."""
    return {
        name: value.detach().double().requires_grad_() for name, value in module.named_parameters()
    }


def perceptron(weights: Weights, i: int, obs: th.Tensor, actions: th.Tensor) -> th.Tensor:
    """Outputs of critic i, shape (B, n_outputs)."""
    x = th.cat([obs, actions], dim=1)
    for layer in (0, 2):
        x = th.relu(
            x @ weights[f"ensemble.{layer}.weight"][i] + weights[f"ensemble.{layer}.bias"][i, 0]
        )
    return x @ weights["ensemble.4.weight"][i].T + weights["ensemble.4.bias"][i, :, 0]


def critic(weights: Weights, i: int, obs: th.Tensor, actions: th.Tensor) -> Any:
    """Mean and deviation of critic i."""
    head = perceptron(weights, i, obs, actions)
    return head[:, 0], th.log1p(th.exp(head[:, 1]))


def fuse(fusion: str, returns: Returns) -> tuple[th.Tensor, th.Tensor]:
    """Fused mean and deviation, by the formulas with squares."""
    if fusion == "min":
        rows = [
            min(((q[k], s[k]) for q, s in returns), key=lambda p: p[0].item()) for k in range(BATCH)
        ]
        return th.stack([q for q, _ in rows]), th.stack([s for _, s in rows])
    precision = th.stack([1 / s**2 for _, s in returns]).sum(dim=0)
    mean = th.stack([q / s**2 for q, s in returns]).sum(dim=0) / precision
    variance = 1 / precision * (len(returns) if fusion == "log_pool" else 1)
    return mean, variance.sqrt()


def actor_sample(weights: Weights, obs: th.Tensor, noise: th.Tensor) -> tuple[th.Tensor, th.Tensor]:
    """Actions and log densities as functions of the actor's weights, the noise being fixed."""
    x = obs
    for layer in (0, 2):
        x = th.relu(x @ weights[f"latent_pi.{layer}.weight"].T + weights[f"latent_pi.{layer}.bias"])
    mean = x @ weights["mu.weight"].T + weights["mu.bias"]
    log_std = (x @ weights["log_std.weight"].T + weights["log_std.bias"]).clamp(-20, 2)
    raw = mean + log_std.exp() * noise
    actions = th.tanh(raw)
    # The density at a fixed point: its gradient with respect to the mean goes through the point.
    log_prob = th.distributions.Normal(mean, log_std.exp()).log_prob(raw)
    return actions, (log_prob - th.log(1 - actions**2 + 1e-6)).sum(dim=1)


def record_noise(monkeypatch: pytest.MonkeyPatch) -> list[th.Tensor]:
    """Let the normal numbers of a step be noted in the order of their draws."""
    drawn: list[th.Tensor] = []
    randn_like = th.randn_like

    def noting(like: th.Tensor) -> th.Tensor:
        # Twice as wide as normal, so that some of the returns meet the bound of the noise.
        noise = randn_like(like) * (2.0 if like.dim() == 1 else 1.0)
        drawn.append(noise.double())
        return noise

    monkeypatch.setattr(th, "randn_like", noting)
    return drawn


def expect(
    model: Any, drawn: list[th.Tensor], batch: Any, before: dict[str, Weights]
) -> tuple[Weights, Weights, list[th.Tensor]]:
    """Gradients of critics and actor, and the new mean deviations, by the printed formulas."""
    n = model.critic.n_critics
    next_noise, noise, new_noise = drawn
    obs, actions = batch.observations.double(), batch.actions.double()
    next_obs = batch.next_observations.double()
    reward, done = batch.rewards.double().flatten(), batch.dones.double().flatten()
    next_actions, next_log_prob = actor_sample(before["actor_target"], next_obs, next_noise)
    target_returns = [critic(before["critic_target"], i, next_obs, next_actions) for i in range(n)]
    q_next, std_next = fuse(model.fusion, target_returns)
    entropy = -ALPHA * next_log_prob
    t_q = (reward + (1 - done) * GAMMA * (q_next + entropy)).detach()
    t_z = t_q + ((1 - done) * GAMMA * std_next * noise.clamp(-3, 3)).detach()

    running = []
    surrogate = th.zeros((), dtype=th.float64)
    for i in range(n):
        q, std = critic(before["critic"], i, obs, actions)
        m = 0.3 + TAU * (std.detach().mean() - 0.3)
        running.append(m)
        b, omega = 3 * m, m**2
        clipped = th.minimum(th.maximum(t_z, q - b), q + b)
        factor_q = -(t_q - q) / (std**2 + 0.1)
        factor_std = -((clipped - q) ** 2 - std**2) / (std**3 + 0.1)
        row = factor_q.detach() * q + factor_std.detach() * std
        surrogate = surrogate + (omega + 0.1) * row.mean()
    critic_leaves = before["critic"]
    critic_gradients = th.autograd.grad(surrogate, list(critic_leaves.values()))

    new_actions, log_prob = actor_sample(before["actor"], obs, new_noise)
    returns = [critic(before["critic"], i, obs, new_actions) for i in range(n)]
    if model.detach_fusion_weights:
        returns = [(q, std.detach()) for q, std in returns]
    q_fused, _ = fuse(model.fusion, returns)
    j_pi = (q_fused - ALPHA * log_prob).mean()
    actor_leaves = before["actor"]
    actor_gradients = th.autograd.grad(-j_pi, list(actor_leaves.values()))
    return (
        dict(zip(critic_leaves, critic_gradients, strict=True)),
        dict(zip(actor_leaves, actor_gradients, strict=True)),
        running,
    )


def assert_descended(before: Weights, network: th.nn.Module, gradients: Weights) -> None:
    """The weights have moved by minus the gradients."""
    for key, weight in network.named_parameters():
        change = before[key].detach() - weight.detach().double()
        scale = max(gradients[key].abs().max().item(), 1e-3)
        th.testing.assert_close(change, gradients[key], rtol=1e-3, atol=1e-4 * scale + 1e-6)


@pytest.mark.parametrize("detach", [False, True])
@pytest.mark.parametrize("fusion", ["product", "log_pool", "min"])
@pytest.mark.parametrize("n_critics", [1, 2, 3])
def test_step_follows_the_formulas(
    make_model: MakeModel,
    fill: Fill,
    monkeypatch: pytest.MonkeyPatch,
    n_critics: int,
    fusion: str,
    detach: bool,
) -> None:
    model = make_model(
        policy_kwargs={"n_critics": n_critics, "optimizer_class": th.optim.SGD},
        learning_rate=1.0,
        gamma=GAMMA,
        tau=TAU,
        ent_coef=ALPHA,
        policy_delay=1,
        fusion=fusion,
        detach_fusion_weights=detach,
    )
    fill(model, 200)
    th.manual_seed(n_critics)
    for network in (model.critic, model.critic_target):
        for weight in network.parameters():
            th.nn.init.normal_(weight, std=0.4)
    model.mean_std.fill_(0.3)
    assert model.replay_buffer is not None
    batch = model.replay_buffer.sample(BATCH)
    names = ("actor", "actor_target", "critic", "critic_target")
    before = {name: doubles(getattr(model, name)) for name in names}
    drawn = record_noise(monkeypatch)
    monkeypatch.setattr(model.replay_buffer, "sample", lambda *_, **__: batch)

    model.train(1, BATCH)

    critic_gradients, actor_gradients, running = expect(model, drawn, batch, before)
    for name, gradients in (("critic", critic_gradients), ("actor", actor_gradients)):
        assert_descended(before[name], getattr(model, name), gradients)
        for key, weight in getattr(model, name).named_parameters():
            averaged = (1 - TAU) * before[f"{name}_target"][key] + TAU * weight.double()
            target = dict(getattr(model, f"{name}_target").named_parameters())[key]
            th.testing.assert_close(target.double(), averaged, rtol=1e-5, atol=1e-6)
    th.testing.assert_close(model.mean_std.double(), th.stack(running), rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize(("n_critics", "subset_size"), [(1, 1), (3, 2), (3, 3)])
def test_step_of_redq_follows_the_formulas(
    make_model: MakeModel,
    fill: Fill,
    monkeypatch: pytest.MonkeyPatch,
    n_critics: int,
    subset_size: int,
) -> None:
    model = make_model(
        REDQ,
        policy_kwargs={"n_critics": n_critics, "optimizer_class": th.optim.SGD},
        learning_rate=1.0,
        gamma=GAMMA,
        tau=TAU,
        ent_coef=ALPHA,
        subset_size=subset_size,
    )
    fill(model, 200)
    for network in (model.critic, model.critic_target):
        for weight in network.parameters():
            th.nn.init.normal_(weight, std=0.4)
    batch = model.replay_buffer.sample(BATCH)
    before = {name: doubles(getattr(model, name)) for name in ("actor", "critic", "critic_target")}
    drawn = record_noise(monkeypatch)
    subset = th.randperm(n_critics)
    monkeypatch.setattr(model.replay_buffer, "sample", lambda *_, **__: batch)
    monkeypatch.setattr(th, "randperm", lambda *_, **__: subset)

    model.train(1, BATCH)

    obs, actions = batch.observations.double(), batch.actions.double()
    next_obs = batch.next_observations.double()
    next_actions, next_log_prob = actor_sample(before["actor"], next_obs, drawn[0])
    lowest = th.stack(
        [
            perceptron(before["critic_target"], int(i), next_obs, next_actions)[:, 0]
            for i in subset[:subset_size]
        ]
    ).amin(dim=0)
    soft_value = lowest - ALPHA * next_log_prob
    y = batch.rewards.double().flatten() + (1 - batch.dones.double().flatten()) * GAMMA * soft_value
    errors = [
        (perceptron(before["critic"], i, obs, actions)[:, 0] - y.detach()) ** 2
        for i in range(n_critics)
    ]
    loss = th.stack([error.mean() for error in errors]).sum()
    new_actions, log_prob = actor_sample(before["actor"], obs, drawn[1])
    returns = [perceptron(before["critic"], i, obs, new_actions)[:, 0] for i in range(n_critics)]
    actor_loss = (ALPHA * log_prob - th.stack(returns).mean(dim=0)).mean()
    for name, value in (("critic", loss), ("actor", actor_loss)):
        gradients = th.autograd.grad(value, list(before[name].values()), retain_graph=True)
        network = getattr(model, name)
        assert_descended(before[name], network, dict(zip(before[name], gradients, strict=True)))
    for key, target in model.critic_target.named_parameters():
        online = dict(model.critic.named_parameters())[key]
        averaged = (1 - TAU) * before["critic_target"][key] + TAU * online.double()
        th.testing.assert_close(target.double(), averaged, rtol=1e-5, atol=1e-6)


def test_detached_weights_change_the_actors_gradient_and_nothing_else(
    make_model: MakeModel, fill: Fill
) -> None:
    after = []
    for detach in (False, True):
        model = make_model(policy_delay=1, detach_fusion_weights=detach)
        for weight in model.critic.parameters():
            weight.data.mul_(3.0)
        fill(model, 100)
        th.manual_seed(0)
        np.random.seed(0)
        model.train(1, BATCH)
        after.append(model)
    critics: list[GaussianCritics] = [model.critic for model in after]
    for a, b in zip(critics[0].parameters(), critics[1].parameters(), strict=True):
        th.testing.assert_close(a.grad, b.grad)
    literal, detached = (next(model.actor.parameters()).grad for model in after)
    assert literal is not None
    assert detached is not None
    assert not th.allclose(literal, detached)


def test_temperature_rises_when_entropy_is_below_its_target(
    make_model: MakeModel, fill: Fill
) -> None:
    for target_entropy, direction in ((50.0, 1.0), (-50.0, -1.0)):
        model = make_model(ent_coef="auto_0.5", target_entropy=target_entropy, policy_delay=1)
        fill(model, 50)
        model.train(3, 16)
        assert direction * (model.log_ent_coef.exp().item() - 0.5) > 0.0


def test_n_step_discounts_are_respected(
    make_model: MakeModel, fill: Fill, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = make_model(n_steps=3, gamma=GAMMA, ent_coef=0.0)
    fill(model, 100)
    assert model.replay_buffer is not None
    batch = model.replay_buffer.sample(BATCH)
    assert batch.discounts is not None
    assert batch.discounts.min() < batch.discounts.max()
    monkeypatch.setattr(th, "randn_like", th.zeros_like)
    th.manual_seed(0)
    with th.no_grad():
        features, _ = model.policy.next_features(batch.next_observations)
        actions, _ = model.actor_target.sample(features)
        value = model.fuse(*model.critic_target(batch.next_observations, actions)).mean
    expected = batch.rewards.flatten() + ((1 - batch.dones) * batch.discounts).flatten() * value
    th.manual_seed(0)
    th.testing.assert_close(model._target(batch)[1].mean, expected)
