"""REDQ: randomised ensembled double Q-learning."""

from sb3_bayes_dsac.redq.policies import CnnPolicy, MlpPolicy, MultiInputPolicy
from sb3_bayes_dsac.redq.redq import REDQ

__all__ = ["REDQ", "CnnPolicy", "MlpPolicy", "MultiInputPolicy"]
