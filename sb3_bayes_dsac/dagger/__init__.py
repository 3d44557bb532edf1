"""DAgger: imitation of a teacher in the states that the learner meets."""

from sb3_bayes_dsac.dagger.dagger import DAgger
from sb3_bayes_dsac.dsac_t.policies import MultiInputPolicy

__all__ = ["DAgger", "MultiInputPolicy"]
