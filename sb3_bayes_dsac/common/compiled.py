"""Losses and gradients of a batch as one graph, compiled by PyTorch's Inductor."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from itertools import islice
from typing import Any, TypeAlias

import torch as th
from torch.fx.experimental.proxy_tensor import make_fx

from sb3_bayes_dsac.common.diagnostics import Diagnostics, Note
from sb3_bayes_dsac.common.minibatches import Batch, tensors_of, with_tensors
from sb3_bayes_dsac.errors import ArgumentError

Losses: TypeAlias = dict[str, th.Tensor]


def require_compilable(*, use_sde: bool) -> None:
    """Refuse what cannot be compiled.

    Args:
        use_sde: Whether the actor explores by gSDE, whose matrix is drawn outside of the graph.

    Raises:
        ArgumentError: With gSDE, or there is no C++ compiler for Inductor.
    """
    if use_sde:
        raise ArgumentError("compile_updates", True, "gSDE cannot be compiled; leave out one")
    compiler = os.environ.get("CXX", "g++")
    if shutil.which(compiler) is None:
        cure = f"there is no {compiler}; install a C++ compiler, or name one in the variable CXX"
        raise ArgumentError("compile_updates", True, cure)


class Compiled:
    """A function of batches of one shape that leaves gradients, without autograd.

    The first call is computed as always while its operations are recorded; later ones run what
    Inductor makes of them. Numbers differ by rounding. Random numbers, weights and statistics are
    those of the moment; whatever else the function reads besides its batch is a constant.

    Args:
        function: Gives losses by name and adds their gradients to weights, which have none before.
        weights: All weights that may get a gradient.
        diagnostics: Where the function leaves notes; each call renews them.
    """

    def __init__(
        self,
        function: Callable[[Batch], Losses],
        weights: list[th.Tensor],
        diagnostics: Diagnostics,
    ) -> None:
        self._function = function
        self._weights = weights
        self._diagnostics = diagnostics
        self._graph: Callable[..., list[th.Tensor]] | None = None
        self._losses: list[str] = []
        self._reached: list[th.Tensor] = []
        self._notes: dict[str, Note] = {}

    def __call__(self, batch: Batch) -> Losses:
        """Losses of a batch; leaves their gradients."""
        if self._graph is None:
            return self._record(batch)
        with th.no_grad():
            results = iter(self._graph(*tensors_of(batch)))
        losses = {name: next(results) for name in self._losses}
        for weight in self._reached:
            weight.grad = next(results)
        for topic, note in self._notes.items():
            self._diagnostics.note(topic, note.report, *islice(results, len(note.tensors)))
        return losses

    def _record(self, batch: Batch) -> Losses:
        """Compute, and keep the graph of what was computed."""
        computed: list[Losses] = []

        def flat(*tensors: th.Tensor) -> list[th.Tensor]:
            computed.append(self._noted(with_tensors(batch, tensors)))
            return self._results(computed[0])

        graph = make_fx(flat)(*tensors_of(batch))
        options: dict[str, Any] = {
            # The generator of PyTorch, so that a seed means the same with and without.
            "fallback_random": True,
            "cpp_wrapper": self._weights[0].device.type == "cpu",
            # They ask in each call what cannot have changed: shapes, and the weights' properties.
            "guard_filter_fn": th.compiler.skip_all_guards_unsafe,
        }
        self._graph = th.compile(graph, dynamic=False, options=options)
        return computed[0]

    def _noted(self, batch: Batch) -> Losses:
        """Call the function, and remember what it notes."""
        others, self._diagnostics.notes = self._diagnostics.notes, {}
        losses = self._function(batch)
        self._notes = self._diagnostics.notes
        self._diagnostics.notes = others | self._notes
        return losses

    def _results(self, losses: Losses) -> list[th.Tensor]:
        """All tensors of a call in one list, in the order in which `__call__` reads them."""
        self._losses = list(losses)
        self._reached = [weight for weight in self._weights if weight.grad is not None]
        gradients = [weight.grad for weight in self._reached if weight.grad is not None]
        noted = [tensor for note in self._notes.values() for tensor in note.tensors]
        return [*(loss.detach() for loss in losses.values()), *gradients, *noted]
