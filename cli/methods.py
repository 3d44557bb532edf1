"""Methods by name: packaged planners, planners that other packages add, trained policies."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from horf_env.errors import UnknownNameError
from horf_env.planners import PLANNERS, Planner

from . import packaged
from .exit_codes import CliError
from .runs import RunFolder

_GROUP = "horf.methods"
POLICY_METHOD = "horf"
"""Name of the packaged policy, and of one that is given without a name."""


@dataclass(frozen=True)
class Method:
    """Something that can drive the robot.

    Attributes:
        name: As in tables.
        policy: Path of the policy that decides; None for a planner.
        trust: Whether the policy may be a zip, which can run any code.
    """

    name: str
    policy: str | None = None
    trust: bool = False

    @property
    def fingerprint(self) -> str:
        """Tells this method from others of its name: weights, or package and version."""
        if self.policy is not None:
            return _digest(Path(self.policy))
        added = _added()
        if self.name not in added:
            return "packaged"
        point = added[self.name]
        return (
            f"{point.value} {point.dist.name} {point.dist.version}" if point.dist else point.value
        )


def parse_methods(
    names: Sequence[str], policies: Sequence[str], *, trust: bool = False
) -> list[Method]:
    """Methods that a user named, each once, checked as far as that is cheap.

    Args:
        names: Names of planners, names given to policies, or paths of run folders.
        policies: "NAME=PATH", or "PATH" for the method "horf".
        trust: Whether policies may be zips, which can run any code.

    Raises:
        UnknownNameError: If a name is none of them, or a policy's is not among the names.
        CliError: If a path is no policy.
    """
    paths = dict(_named_policy(text) for text in policies)
    for name in paths:
        if name not in names:
            raise UnknownNameError("method of a policy", name, names)
    return [_method(name, paths, trust=trust) for name in dict.fromkeys(names)]


def planner_names() -> list[str]:
    """Names of all planners, packaged and added."""
    return [*PLANNERS, *_added()]


def make_planner(method: Method) -> Planner:
    """What drives the robot.

    Raises:
        UnknownNameError: If there is no planner of that name.
        CliError: If its policy cannot be loaded, or its planner cannot be made.
    """
    if method.policy is not None:
        from .policies import load_policy

        return load_policy(Path(method.policy), trust=method.trust)
    if method.name in PLANNERS:
        return PLANNERS[method.name]()
    added = _added()
    if method.name not in added:
        raise UnknownNameError("method", method.name, planner_names())
    return _load(added[method.name])


def _named_policy(text: str) -> tuple[str, str]:
    name, separator, path = text.partition("=")
    return (name, path) if separator else (POLICY_METHOD, text)


def _method(name: str, policies: dict[str, str], *, trust: bool) -> Method:
    if name in policies:
        path = policies[name]
    elif name in planner_names():
        return Method(name)
    elif name == POLICY_METHOD:
        path = str(packaged.POLICY)
    elif Path(name).exists():
        path = name
    else:
        raise UnknownNameError("method", name, [*planner_names(), POLICY_METHOD])
    if Path(path).is_dir():
        RunFolder.around(Path(path)).read()
    elif not Path(path).exists():
        raise CliError(f"{path}: no such file")
    return Method(name, path, trust)


def _added() -> dict[str, EntryPoint]:
    """Planners of other packages; a packaged name cannot be taken over."""
    points = {point.name: point for point in entry_points(group=_GROUP)}
    if taken := set(points) & set(PLANNERS):
        raise CliError(f"entry point {_GROUP}: {', '.join(sorted(taken))} is a packaged method")
    return points


def _load(point: EntryPoint) -> Planner:
    try:
        planner: Planner = point.load()()
    except Exception as error:  # the code of another package may raise anything
        raise CliError(f"method {point.name} ({point.value}): {error}") from error
    if not isinstance(getattr(planner, "action_layer", None), str):
        raise CliError(f"method {point.name} ({point.value}): expected a Planner with action_layer")
    return planner


def _digest(path: Path) -> str:
    """SHA-256 of a policy: the file itself, or that of a run."""
    from .policies import policy_file

    return hashlib.sha256(policy_file(path).read_bytes()).hexdigest()
