"""Makes the algorithms of this package known to rl_zoo3, with hyperparameters for them."""

from __future__ import annotations

import argparse
from importlib import resources
from types import MappingProxyType
from typing import Final

from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from sb3_bayes_dsac import DSACT, REDQ, BayesDSAC

ALGORITHMS: Final = MappingProxyType[str, type[OffPolicyAlgorithm]](
    {"bayes_dsac": BayesDSAC, "dsac_t": DSACT, "redq": REDQ}
)
# Whose search space of rl_zoo3 ours take: they share all of its arguments.
_TUNED_LIKE: Final = "sac"


def register() -> None:
    """Enter the algorithms into rl_zoo3's tables, which all of its commands read.

    Raises:
        ImportError: rl_zoo3 is not installed.
    """
    from rl_zoo3 import ALGOS
    from rl_zoo3.hyperparams_opt import HYPERPARAMS_CONVERTER, HYPERPARAMS_SAMPLER

    ALGOS.update(ALGORITHMS)
    for table in (HYPERPARAMS_SAMPLER, HYPERPARAMS_CONVERTER):
        table.update(dict.fromkeys(ALGORITHMS, table[_TUNED_LIKE]))


def with_hyperparameters(argv: list[str]) -> list[str]:
    """A command line of rl_zoo3 that uses this package's hyperparameters.

    Args:
        argv: Program, command, options.

    Returns:
        The same, with our file for `train --algo` of ours if it names no file itself.
    """
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--algo")
    parser.add_argument("-conf", "--conf-file")
    options, _ = parser.parse_known_args(argv[2:])
    if argv[1:2] != ["train"] or options.algo not in ALGORITHMS or options.conf_file:
        return argv
    file = resources.files(__package__) / "hyperparams" / f"{options.algo}.yml"
    return [*argv, "-conf", str(file)]
