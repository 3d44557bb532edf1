from __future__ import annotations

import math

import pytest
import torch as th
from hypothesis import given, settings
from hypothesis import strategies as st

from sb3_bayes_dsac.common.gaussian import FUSIONS, bounded_error, weight_entropy

MEANS = st.floats(-1e3, 1e3)
STDS = st.floats(1e-6, 1e4)
CRITICS = st.lists(st.tuples(MEANS, STDS), min_size=1, max_size=10)
ALL = sorted(FUSIONS)


def tensors(critics: list[tuple[float, float]]) -> tuple[th.Tensor, th.Tensor]:
    """Means and deviations of shape (n, 1) in float64."""
    values = th.tensor(critics, dtype=th.float64)
    return values[:, :1], values[:, 1:]


@pytest.mark.parametrize("name", ALL)
@settings(max_examples=100, deadline=None)
@given(critics=CRITICS)
def test_mean_is_convex_and_weights_explain_it(
    name: str, critics: list[tuple[float, float]]
) -> None:
    means, stds = tensors(critics)
    mean, _, weights = FUSIONS[name](means, stds)
    slack = 1e-9 * (1 + means.abs().max())
    assert means.min() - slack <= mean.item() <= means.max() + slack
    assert weights.min() >= 0.0
    assert weights.sum().item() == pytest.approx(1.0)
    assert (weights * means).sum().item() == pytest.approx(mean.item(), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", ALL)
@settings(max_examples=60, deadline=None)
@given(critics=st.lists(st.tuples(MEANS, STDS), min_size=2, max_size=6, unique_by=lambda c: c[0]))
def test_order_of_critics_is_irrelevant(name: str, critics: list[tuple[float, float]]) -> None:
    forward = FUSIONS[name](*tensors(critics))
    backward = FUSIONS[name](*tensors(critics[::-1]))
    th.testing.assert_close(forward.mean, backward.mean)
    th.testing.assert_close(forward.std, backward.std)
    th.testing.assert_close(forward.weights, backward.weights.flip(0))


@settings(max_examples=100, deadline=None)
@given(critics=st.lists(st.tuples(MEANS, STDS), min_size=2, max_size=2))
def test_product_of_two_is_the_papers_formula(critics: list[tuple[float, float]]) -> None:
    (q1, s1), (q2, s2) = critics
    fused = FUSIONS["product"](*tensors(critics))
    total = s1**2 + s2**2
    assert fused.mean.item() == pytest.approx((q1 * s2**2 + q2 * s1**2) / total, abs=1e-9)
    assert fused.std.item() ** 2 == pytest.approx(s1**2 * s2**2 / total)


@settings(max_examples=100, deadline=None)
@given(critics=CRITICS.filter(lambda critics: len(critics) > 1))
def test_product_is_surer_than_any_critic(critics: list[tuple[float, float]]) -> None:
    means, stds = tensors(critics)
    # Strictly below in exact arithmetic; equal where one critic is surer by 1e8.
    assert FUSIONS["product"](means, stds).std.item() <= stds.min().item() * (1 + 1e-12)


@settings(max_examples=60, deadline=None)
@given(mean=MEANS, std=STDS, n=st.integers(1, 10))
def test_agreeing_critics(mean: float, std: float, n: int) -> None:
    means, stds = tensors([(mean, std)] * n)
    assert FUSIONS["product"](means, stds).std.item() == pytest.approx(std / math.sqrt(n))
    assert FUSIONS["log_pool"](means, stds).std.item() == pytest.approx(std)
    assert FUSIONS["min"](means, stds).std.item() == pytest.approx(std)


@pytest.mark.parametrize("name", ALL)
def test_one_critic_is_left_alone(name: str) -> None:
    means, stds = th.randn(1, 50), th.rand(1, 50) + 0.01
    fused = FUSIONS[name](means, stds)
    th.testing.assert_close(fused.mean, means[0])
    th.testing.assert_close(fused.std, stds[0])


@pytest.mark.parametrize("name", ["product", "log_pool"])
def test_a_critic_without_confidence_has_no_weight(name: str) -> None:
    means = th.tensor([[3.0], [-50.0]])
    fused = FUSIONS[name](means, th.tensor([[0.5], [1e8]]))
    assert fused.mean.item() == pytest.approx(3.0)
    assert fused.weights[1].item() == pytest.approx(0.0, abs=1e-12)
    if name == "product":
        assert fused.std.item() == pytest.approx(0.5)


def test_min_takes_mean_and_deviation_of_one_critic() -> None:
    means = th.tensor([[1.0, 5.0], [2.0, -5.0], [3.0, 0.0]])
    stds = th.tensor([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])
    fused = FUSIONS["min"](means, stds)
    assert fused.mean.tolist() == [1.0, -5.0]
    assert fused.std.tolist() == pytest.approx([0.1, 0.4])


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("stds", [(1e-8, 1e-8), (1e8, 1e8), (1e-8, 1e8), (0.0, 0.0), (0.0, 1e8)])
def test_extreme_deviations_stay_finite_with_gradients(
    name: str, stds: tuple[float, float]
) -> None:
    means = th.tensor([[1.0], [2.0]], requires_grad=True)
    deviations = th.tensor([[stds[0]], [stds[1]]], requires_grad=True)
    fused = FUSIONS[name](means, deviations)
    th.autograd.backward(fused.mean.sum())
    assert th.isfinite(fused.mean).all()
    assert th.isfinite(fused.std).all()
    assert 1.0 <= fused.mean.item() <= 2.0
    for leaf in (means, deviations):
        assert leaf.grad is None or th.isfinite(leaf.grad).all()


@pytest.mark.parametrize(
    ("rows", "entropy"),
    [([[1.0], [0.0]], 0.0), ([[0.5], [0.5]], math.log(2)), ([[0.25]] * 4, math.log(4))],
)
def test_weight_entropy(rows: list[list[float]], entropy: float) -> None:
    assert weight_entropy(th.tensor(rows)).item() == pytest.approx(entropy)


@settings(max_examples=60, deadline=None)
@given(target=MEANS, mean=MEANS, bound=st.floats(1e-3, 100.0))
def test_bounded_error_is_the_clipped_target_minus_the_mean(
    target: float, mean: float, bound: float
) -> None:
    targets, means = th.tensor([target]).double(), th.tensor([[mean]]).double()
    error = bounded_error(targets, means, th.tensor([bound]).double()).item()
    expected = min(max(target, mean - bound), mean + bound) - mean
    assert error == pytest.approx(expected, abs=1e-3)


def test_each_critic_has_its_own_bound() -> None:
    errors = bounded_error(th.tensor([10.0]), th.zeros(2, 1), th.tensor([1.0, 2.0]))
    assert errors.tolist() == [[1.0], [2.0]]
