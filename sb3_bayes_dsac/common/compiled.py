"""Losses and gradients of a batch as one graph, compiled by PyTorch's Inductor."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from itertools import islice
from typing import Any, NamedTuple

import torch as th
from stable_baselines3.common.type_aliases import DictReplayBufferSamples, ReplayBufferSamples
from torch.fx.experimental.proxy_tensor import make_fx

from sb3_bayes_dsac.common.diagnostics import Diagnostics, Note
from sb3_bayes_dsac.common.minibatches import tensors_of, with_tensors
from sb3_bayes_dsac.errors import ArgumentError


class Differentiated(NamedTuple):
    """What a gradient step makes of a batch.

    Attributes:
        losses: Scalars by name.
        gradients: Of the weights that the step moves; None for those that no loss reaches.
    """

    losses: dict[str, th.Tensor]
    gradients: list[th.Tensor | None]


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
    """A function of batches of one shape, gradients included, without autograd.

    The first call is computed as always while its operations are recorded; later ones run what
    Inductor makes of them. Numbers differ by rounding. Random numbers, weights and statistics are
    those of the moment; whatever else the function reads besides its batch is a constant.

    Args:
        function: What to compile.
        diagnostics: Where the function leaves notes; each call renews them.
    """

    def __init__(
        self,
        function: Callable[[ReplayBufferSamples | DictReplayBufferSamples], Differentiated],
        diagnostics: Diagnostics,
    ) -> None:
        self._function = function
        self._diagnostics = diagnostics
        self._graph: Callable[..., list[th.Tensor]] | None = None
        self._losses: list[str] = []
        self._is_reached: list[bool] = []
        self._notes: dict[str, Note] = {}

    def __call__(self, batch: ReplayBufferSamples | DictReplayBufferSamples) -> Differentiated:
        """Losses and gradients of a batch."""
        if self._graph is None:
            return self._record(batch)
        with th.no_grad():
            results = iter(self._graph(*tensors_of(batch)))
        losses = {name: next(results) for name in self._losses}
        gradients = [next(results) if is_reached else None for is_reached in self._is_reached]
        for topic, note in self._notes.items():
            self._diagnostics.note(topic, note.report, *islice(results, len(note.tensors)))
        return Differentiated(losses, gradients)

    def _record(self, batch: ReplayBufferSamples | DictReplayBufferSamples) -> Differentiated:
        """Compute, and keep the graph of what was computed."""
        computed: list[Differentiated] = []

        def flat(*tensors: th.Tensor) -> list[th.Tensor]:
            computed.append(self._noted(with_tensors(batch, tensors)))
            return self._results(computed[0])

        graph = make_fx(flat)(*tensors_of(batch))
        options: dict[str, Any] = {
            # The generator of PyTorch, so that a seed means the same with and without.
            "fallback_random": True,
            "cpp_wrapper": next(graph.parameters()).device.type == "cpu",
            # They ask in each call what cannot have changed: shapes, and the weights' properties.
            "guard_filter_fn": th.compiler.skip_all_guards_unsafe,
        }
        self._graph = th.compile(graph, dynamic=False, options=options)
        return computed[0]

    def _noted(self, batch: ReplayBufferSamples | DictReplayBufferSamples) -> Differentiated:
        """Call the function, and remember what it notes."""
        others, self._diagnostics.notes = self._diagnostics.notes, {}
        differentiated = self._function(batch)
        self._notes = self._diagnostics.notes
        self._diagnostics.notes = others | self._notes
        return differentiated

    def _results(self, differentiated: Differentiated) -> list[th.Tensor]:
        """All tensors of a call in one list, in the order in which `__call__` reads them."""
        self._losses = list(differentiated.losses)
        self._is_reached = [gradient is not None for gradient in differentiated.gradients]
        losses = [loss.detach() for loss in differentiated.losses.values()]
        gradients = [gradient for gradient in differentiated.gradients if gradient is not None]
        noted = [tensor for note in self._notes.values() for tensor in note.tensors]
        return [*losses, *gradients, *noted]
