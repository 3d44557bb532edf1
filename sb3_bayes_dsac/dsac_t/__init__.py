"""DSAC-T: distributional soft actor-critic with three refinements."""

from sb3_bayes_dsac.dsac_t.dsac_t import DSACT
from sb3_bayes_dsac.dsac_t.policies import CnnPolicy, MlpPolicy, MultiInputPolicy

__all__ = ["DSACT", "CnnPolicy", "MlpPolicy", "MultiInputPolicy"]
