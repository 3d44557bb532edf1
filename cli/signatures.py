"""Settings of an algorithm checked against the signature of its constructor."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from functools import reduce
from operator import or_
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError

from horf_env.errors import UnknownNameError

from .algorithms import Setting, SettingError

_PLAIN = (bool, int, float, str)
# Arguments that hold no plain value, or that the harness gives itself.
_HIDDEN = {"self", "policy", "env", "policy_kwargs", "_init_setup_model", "tensorboard_log"}


def check_arguments(algorithm: Any, arguments: Mapping[str, Setting]) -> None:
    """Refuse arguments that the constructor does not have, or of another type.

    Args:
        algorithm: A class of Stable-Baselines3's kind.
        arguments: What it is to be called with.

    Raises:
        UnknownNameError: If there is no such argument; names the nearest.
        SettingError: If a value has the wrong type.
    """
    types = plain_types(algorithm)
    for name, value in arguments.items():
        if name not in types:
            raise UnknownNameError(f"setting of {algorithm.__name__}", name, types)
        try:
            TypeAdapter(types[name], config=ConfigDict(strict=True)).validate_python(value)
        except ValidationError as error:
            expected = " or ".join(part.__name__ for part in _members(types[name]))
            raise SettingError(name, f"expected {expected}, got {value!r}") from error


def plain_types(algorithm: Any) -> dict[str, Any]:
    """Arguments that numbers, names and switches can be given to, with the types for these."""
    # SB3 imports this name for type checkers only.
    hints = get_type_hints(algorithm.__init__, localns={"VecEnv": object})
    found = {}
    for name in inspect.signature(algorithm.__init__).parameters:
        plain = [part for part in _members(hints.get(name)) if part in _PLAIN]
        if plain and name not in _HIDDEN:
            found[name] = reduce(or_, plain)
    return found


def _members(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
