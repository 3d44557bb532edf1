"""DSAC-T: distributional soft actor-critic with three refinements."""

from sb3_bayes_dsac.common.policies import CnnPolicy, MlpPolicy, MultiInputPolicy
from sb3_bayes_dsac.dsac_t.dsac_t import DSACT

__all__ = ["DSACT", "CnnPolicy", "MlpPolicy", "MultiInputPolicy"]
