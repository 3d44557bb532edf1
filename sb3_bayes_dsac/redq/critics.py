"""Critics of the mean return."""

from __future__ import annotations

from typing import ClassVar

import torch as th
from stable_baselines3.common.type_aliases import PyTorchObs

from sb3_bayes_dsac.common.critics import EnsembleCritics


class MeanCritics(EnsembleCritics):
    """n critics of the mean return Q_i(s, a). Arguments are those of `EnsembleCritics`."""

    n_outputs: ClassVar[int] = 1

    def forward(self, obs: PyTorchObs, actions: th.Tensor) -> th.Tensor:
        """Mean returns, shape (n_critics, B).

        Args:
            obs: Batch of observations.
            actions: Batch of actions scaled to [-1, 1], shape (B, action_dim).
        """
        return self.evaluate(self.encode(obs), actions)

    def evaluate(
        self, features: th.Tensor, actions: th.Tensor, *, frozen: bool = False
    ) -> th.Tensor:
        """As `forward`, from features of shape (B, features_dim); `frozen` as in `outputs`."""
        return self.outputs(features, actions, frozen=frozen).squeeze(dim=1)

    def evaluate_subset(
        self, features: th.Tensor, actions: th.Tensor, subset: th.Tensor
    ) -> th.Tensor:
        """Mean returns of the critics with these indices, shape (len(subset), B)."""
        return self.subset_outputs(features, actions, subset).squeeze(dim=1)
