"""Bayes-DSAC: DSAC-T with Bayesian fusion of its critics."""

from __future__ import annotations

from typing import ClassVar

from sb3_bayes_dsac.dsac_t.dsac_t import DSACT


class BayesDSAC(DSACT):
    """Bayesian Distributional Soft Actor-Critic (Bayes-DSAC), on Stable-Baselines3.

    Target return and actor value come from the normalised product of the critics' Gaussians
    (`common.gaussian.product`, eq. `eq11` of the paper) instead of from the critic with the
    smallest mean. All else is `DSACT`, including all arguments, since the paper states no other
    change. `fusion="log_pool"` keeps sigma the deviation of the return, which the paper's rule
    shrinks by sqrt(n) in every Bellman backup.

    The paper's J_pi depends on sigma(s, a) through the fusion weights and says nothing of
    stopping that gradient; by default it flows (`detach_fusion_weights=False`).
    """

    default_fusion: ClassVar[str] = "product"
