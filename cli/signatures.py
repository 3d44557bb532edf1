"""Settings of an algorithm checked against the signature of its constructor."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
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


def check_arguments(algorithm: type, arguments: Mapping[str, Setting]) -> None:
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


def plain_types(algorithm: type) -> dict[str, Any]:
    """Arguments that numbers, names and switches can be given to, with the types for these."""
    found: dict[str, Any] = {}
    for constructor in _constructors(algorithm):
        # SB3 imports this name for type checkers only.
        hints = get_type_hints(constructor, localns={"VecEnv": object})
        for name in inspect.signature(constructor).parameters:
            plain = [part for part in _members(hints.get(name)) if part in _PLAIN]
            if plain and name not in _HIDDEN:
                found.setdefault(name, reduce(or_, plain))
    return found


def _constructors(algorithm: type) -> Iterator[Any]:
    """Its constructor, and those of its bases that get the rest of the arguments by `**kwargs`."""
    for cls in algorithm.__mro__:
        if "__init__" in cls.__dict__:
            constructor = cls.__dict__["__init__"]
            yield constructor
            kinds = [p.kind for p in inspect.signature(constructor).parameters.values()]
            if inspect.Parameter.VAR_KEYWORD not in kinds:
                return


def _members(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
