"""Methods by name: planners of `horf_env`, and trained policies by their path."""

from __future__ import annotations

from pathlib import Path

from horf_env.errors import UnknownNameError
from horf_env.planners import PLANNERS, Planner

from .runs import RunFolder


def check_method(method: str) -> None:
    """Refuse what is no method, before anything is loaded.

    Raises:
        UnknownNameError: If it is neither a planner's name nor an existing path.
        CliError: If the path is no run.
    """
    if method in PLANNERS:
        return
    if not Path(method).exists():
        raise UnknownNameError("method", method, [*PLANNERS, "<run folder>"])
    RunFolder.around(Path(method)).read()


def make_planner(method: str) -> Planner:
    """The planner of that name, or the policy in that run folder or checkpoint.

    Raises:
        UnknownNameError: If it is neither.
        CliError: If the path holds no policy.
    """
    if method in PLANNERS:
        return PLANNERS[method]()
    check_method(method)
    from .policies import load_policy

    return load_policy(Path(method))
