"""Losses and gradients of a batch as one graph, compiled by PyTorch's Inductor."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from itertools import islice
from typing import Any, Final, TypeAlias

import torch as th
from torch._inductor import compile as compile_graph
from torch._ops import OpOverload
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


def _baddbmm(
    bias: th.Tensor, x: th.Tensor, weight: th.Tensor, *, beta: float = 1, alpha: float = 1
) -> th.Tensor:
    """A product, then the bias, which the kernel of the activation adds in passing.

    PyTorch's own operation copies the bias to each row of the result first.
    """
    return alpha * th.bmm(x, weight) + beta * bias


def _addmm(bias: th.Tensor, x: th.Tensor, weight: th.Tensor, **scales: float) -> th.Tensor:
    """As `_baddbmm`, whose batch of one keeps Inductor from making an `addmm` of it again."""
    return _baddbmm(bias, x[None], weight[None], **scales)[0]


def _mm(x: th.Tensor, weight: th.Tensor) -> th.Tensor:
    """A product, as a batch of one for the same reason."""
    return th.bmm(x[None], weight[None])[0]


DECOMPOSITIONS: Final[dict[OpOverload[..., Any], Callable[..., th.Tensor]]] = {
    th.ops.aten.mm.default: _mm,
    th.ops.aten.baddbmm.default: _baddbmm,
    th.ops.aten.addmm.default: _addmm,
}


def _lift_constants(module: th.fx.GraphModule) -> list[th.Tensor]:
    """Make inputs, after its own, of the tensors that a graph refers to, and list them.

    As constants, Inductor would read them once; as inputs, it sees each step of an optimiser and
    may change statistics in place.
    """
    graph = module.graph
    *_, last = graph.find_nodes(op="placeholder")
    inputs: dict[str, th.fx.Node] = {}
    for node in graph.find_nodes(op="get_attr"):
        if node.target not in inputs:
            with graph.inserting_after(last):
                last = inputs[node.target] = graph.placeholder(node.target)
        node.replace_all_uses_with(inputs[node.target])
        graph.erase_node(node)
    module.recompile()
    return [getattr(module, name) for name in inputs]


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
        self._constants: list[th.Tensor] = []
        self._losses: list[str] = []
        self._reached: list[th.Tensor] = []
        self._notes: dict[str, Note] = {}

    def __call__(self, batch: Batch) -> Losses:
        """Losses of a batch; leaves their gradients."""
        if self._graph is None:
            return self._record(batch)
        with th.no_grad():
            results = iter(self._graph(*tensors_of(batch), *self._constants))
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

        recorded = make_fx(flat)(*tensors_of(batch))
        self._constants = _lift_constants(recorded)
        inputs = [*tensors_of(batch), *self._constants]
        # Taken apart in a second pass, so that the first call has no rounding of its own.
        graph = make_fx(recorded, DECOMPOSITIONS, tracing_mode="fake")(*inputs)
        options: dict[str, Any] = {
            # The generator of PyTorch, so that a seed means the same with and without.
            "fallback_random": True,
            "cpp_wrapper": self._weights[0].device.type == "cpu",
        }
        with th.no_grad():
            self._graph = compile_graph(graph, [*inputs], options)
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
