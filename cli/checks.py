"""Checks of an installation: packages, programs, and one tick of the real thing."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

from packaging.requirements import Requirement

from .provenance import requirements

# Modules whose name is not that of their distribution.
_MODULES = {
    "pin": "pinocchio",
    "rerun-sdk": "rerun",
    "sb3-contrib": "sb3_contrib",
    "stable-baselines3": "stable_baselines3",
}
_WARM_UP = 5  # steps


@dataclass(frozen=True)
class Check:
    """Result of a check.

    Attributes:
        name: What was checked.
        ok: Whether it works.
        detail: Version or figures, or what is wrong.
        cure: What to do, "" if it works.
    """

    name: str
    ok: bool
    detail: str
    cure: str = ""


def all_checks() -> Iterator[Check]:
    """Run all checks, the quick ones first."""
    for requirement in requirements():
        yield check_package(requirement)
    yield _checked("rerun program", _rerun, cure="pip install rerun-sdk")
    yield _checked("environment", _one_tick, cure="install what is missing above")


def check_package(requirement: Requirement) -> Check:
    """Whether a package is there, recent enough and can be imported."""
    name, cure = requirement.name, f'pip install "{requirement}"'
    try:
        found = version(name)
        importlib.import_module(_MODULES.get(name, name))
    except PackageNotFoundError:
        return Check(name, False, "missing", cure)
    except Exception as error:  # a broken package may raise anything
        return Check(name, False, f"does not import: {error}", f"{cure} --force-reinstall")
    if not requirement.specifier.contains(found, prereleases=True):
        return Check(name, False, f"{found}, needed {requirement.specifier}", cure)
    return Check(name, True, found)


def _checked(name: str, run: Callable[[], str], *, cure: str) -> Check:
    try:
        return Check(name, True, run())
    except Exception as error:  # whatever is wrong with this machine
        return Check(name, False, f"{type(error).__name__}: {error}", cure)


def _rerun() -> str:
    from .viewer import rerun_program

    return str(rerun_program())


def _one_tick() -> str:
    """One depth image and one QP in a real scene, after some that warm everything up."""
    from .environments import EnvSettings, make_env, reach_env
    from .methods import Method, make_planner

    planner = make_planner(Method("hra"))
    env = make_env(EnvSettings(scene="room").for_planner(planner))
    observation, _ = env.reset(seed=0, options={"instance": 0})
    planner.reset(env)
    for _ in range(_WARM_UP):
        observation, *_, info = env.step(planner.act(observation))
    record = reach_env(env).record
    env.close()
    measured = int((record.depth > 0.0).sum())
    if not measured or record.command is None or record.command.qp is None:
        raise RuntimeError("the depth image is empty, or there was no QP")
    height, width = record.depth.shape
    milliseconds = 1e3 * record.command.qp.solve_time
    return (
        f"depth {width}x{height}, {measured} pixels measured; "
        f"QP {info['qp_status']} in {milliseconds:.2f} ms"
    )
