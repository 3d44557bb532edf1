"""Bayes-DSAC: DSAC-T with Bayesian fusion of its critics."""

from sb3_bayes_dsac.bayes_dsac.bayes_dsac import BayesDSAC
from sb3_bayes_dsac.dsac_t.policies import CnnPolicy, MlpPolicy, MultiInputPolicy

__all__ = ["BayesDSAC", "CnnPolicy", "MlpPolicy", "MultiInputPolicy"]
