"""Adam by its fused kernel and little else."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final

import torch as th
from torch.optim.optimizer import _global_optimizer_post_hooks, _global_optimizer_pre_hooks

# Averages below this size become zero, at every so many steps. At the usual beta1 of 0.9, 100 steps
# without a gradient take this size to just above the smallest normal float, 1.2e-38.
VANISHING: Final = 1e-33
FORGET_EVERY: Final = 100


class FusedAdam(th.optim.Adam):
    """`torch.optim.Adam(fused=True)` with the same weights, state and hooks, at less cost a step.

    PyTorch's own step looks at each call for sparse weights, several devices, gradient scalers and
    compilation, and opens a range for its profiler. None of them is used here, and after the
    products of a gradient step that code is no longer in the processor's caches: it costs 0.2 ms a
    step where the kernel takes as little.

    A weight that gets no gradient any more, as those of dead ReLU do, has averages that decay until
    rounding holds them among the subnormal floats, each of which costs a processor a hundred
    cycles: after some thousand steps Adam took half the time of training. Here averages become zero
    before, which moves no weight: an average of 1e-33 stands for a step of 1e-25 learning rates.

    Args:
        params: Weights, all on one device and of one type.
        options: Of `torch.optim.Adam`, but for those that choose another kernel.
    """

    def __init__(self, params: Iterable[Any], **options: Any) -> None:
        super().__init__(params, fused=True, **options)

    def step(self, closure: Callable[[], Any] | None = None) -> None:  # type: ignore[override]
        """Update all weights that have a gradient.

        Args:
            closure: Computes the gradients first, if there is one.
        """
        hooks = (
            self._optimizer_step_pre_hooks,
            self._optimizer_step_post_hooks,
            _global_optimizer_pre_hooks,
            _global_optimizer_post_hooks,
        )
        step = self._step_between_hooks if any(hooks) else self._step
        step(closure)

    # What PyTorch looks for before it wraps `step` as below, whether there are hooks or not.
    step.hooked = True  # type: ignore[attr-defined]

    @th.no_grad()
    def _step(self, closure: Callable[[], Any] | None) -> None:
        """Update, without a look at hooks."""
        if closure is not None:
            with th.enable_grad():
                closure()
        for group in self.param_groups:
            # Weights, gradients, both averages, largest averages, numbers of steps.
            tensors: tuple[list[th.Tensor], ...] = ([], [], [], [], [], [])
            self._init_group(group, *tensors)  # type: ignore[no-untyped-call]
            if tensors[0]:
                _update(group, *tensors)

    _step_between_hooks = th.optim.Optimizer.profile_hook_step(_step)


def _update(group: dict[str, Any], *tensors: list[th.Tensor]) -> None:
    """One step of the weights of a group, by its options."""
    # A number would become a tensor once for each weight.
    th._foreach_add_(tensors[-1], th.ones_like(tensors[-1][0]), alpha=1.0)
    kernel = th._fused_adamw_ if group["decoupled_weight_decay"] else th._fused_adam_
    kernel(
        *tensors,
        lr=group["lr"],
        beta1=group["betas"][0],
        beta2=group["betas"][1],
        weight_decay=group["weight_decay"],
        eps=group["eps"],
        amsgrad=group["amsgrad"],
        maximize=group["maximize"],
    )
    if int(tensors[-1][0]) % FORGET_EVERY == 0:
        for average in (*tensors[2], *tensors[3]):
            average.masked_fill_(average.abs() < VANISHING, 0.0)
