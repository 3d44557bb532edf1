"""Policies of REDQ: many critics of the mean return, no target actor."""

from __future__ import annotations

from typing import ClassVar

from sb3_bayes_dsac.common.critics import EnsembleCritics
from sb3_bayes_dsac.common.policies import DictInput, EnsemblePolicy, ImageInput
from sb3_bayes_dsac.redq.critics import MeanCritics


class REDQPolicy(EnsemblePolicy):
    """Actor, ten batched critics and their target.

    Arguments are those of `EnsemblePolicy`; the default of `n_critics` is 10, as in REDQ.
    """

    critic_class: ClassVar[type[EnsembleCritics]] = MeanCritics
    default_n_critics: ClassVar[int] = 10
    critic: MeanCritics
    critic_target: MeanCritics


class CnnPolicy(ImageInput, REDQPolicy):
    """Policy for image observations."""


class MultiInputPolicy(DictInput, REDQPolicy):
    """Policy for Dict observations."""


MlpPolicy = REDQPolicy
