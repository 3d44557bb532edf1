"""Bayes-DSAC and its relatives as Stable-Baselines3 algorithms.

Example:
    >>> from sb3_bayes_dsac import BayesDSAC
    >>> model = BayesDSAC("MlpPolicy", "Pendulum-v1", seed=0).learn(5_000)
"""

from sb3_bayes_dsac.bayes_dsac import BayesDSAC
from sb3_bayes_dsac.dagger import DAgger
from sb3_bayes_dsac.dsac_t import DSACT
from sb3_bayes_dsac.redq import REDQ

__all__ = ["DSACT", "REDQ", "BayesDSAC", "DAgger"]
