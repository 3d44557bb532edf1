"""Settings of a run from a TOML file, from `-p key=value`, and from options."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from horf_env.errors import UnknownNameError

from .config import TrainConfig, updated
from .environments import EnvSettings
from .exit_codes import UsageError

_FIELDS = {
    *TrainConfig.model_fields,
    *(f"env.{name}" for name in EnvSettings.model_fields),
    *(
        f"{part}.{name}"
        for part in ("protocol", "storage")
        for name in type(TrainConfig.model_fields[part].default).model_fields
    ),
}


class ConfigError(UsageError):
    """A file of settings or a `-p` that cannot be used; names line and field."""


def make_config(
    *,
    file: Path | None = None,
    options: Mapping[str, Any] | None = None,
    parameters: Sequence[str] = (),
) -> TrainConfig:
    """Settings of a run; what comes later in the arguments wins.

    Args:
        file: TOML.
        options: Values by dotted name ("env.scene"); None stands for "not given".
        parameters: "key=value", with a value as in TOML, or a name without quotes. A key without
            a dot that is no setting of a run is one of the algorithm.

    Raises:
        ConfigError: If something is malformed or of the wrong type.
        UnknownNameError: If there is no such setting.
        OSError: If the file cannot be read.
    """
    text = file.read_text() if file else ""
    data = _parsed(text, file)
    origins: dict[tuple[str, ...], str] = {}
    for name, value in (options or {}).items():
        if value is not None:
            data = updated(data, tuple(name.split(".")), value)
            origins[tuple(name.split("."))] = f"--{name.split('.')[-1].replace('_', '-')}"
    for parameter in parameters:
        path, value = _assignment(parameter)
        data, origins[path] = updated(data, path, value), f"-p {parameter}"
    return _validated(data, origins, text, file)


def _parsed(text: str, file: Path | None) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{file}: {error}") from error


def _assignment(text: str) -> tuple[tuple[str, ...], Any]:
    key, equals, value = text.partition("=")
    if not equals or not re.fullmatch(r"\w+(\.\w+)*", key):
        raise ConfigError(f"-p {text}: expected key=value, as learning_rate=3e-4")
    path = tuple(key.split("."))
    if len(path) == 1 and key not in _FIELDS:
        path = ("settings", key)
    elif path[0] != "settings" and key not in _FIELDS:
        raise UnknownNameError("setting", key, _FIELDS)
    return path, _value(value)


def _value(text: str) -> Any:
    """A TOML value; what is none is a name. 1e6 is an integer too, where one is expected."""
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _validated(
    data: dict[str, Any], origins: Mapping[tuple[str, ...], str], text: str, file: Path | None
) -> TrainConfig:
    try:
        return TrainConfig.model_validate_json(json.dumps(data, default=str))
    except ValidationError as error:
        first = error.errors()[0]
        path = tuple(map(str, first["loc"]))
        if first["type"] == "extra_forbidden":
            raise _unknown(path, text, file) from error
        known = next((origins[path[:n]] for n in (1, 2) if path[:n] in origins), None)
        where = known or f"{file}, line {_line(text, path)}"
        name = ".".join(path[:2])
        raise ConfigError(f"{where}: field {name!r}: {first['msg']}") from error


def _unknown(path: tuple[str, ...], text: str, file: Path | None) -> Exception:
    name = ".".join(path)
    return UnknownNameError(f"setting ({file}, line {_line(text, path)})", name, _FIELDS)


def _line(text: str, path: Sequence[str]) -> int:
    """Line of a key in TOML, or of its table, or 1: the parser of the library keeps none."""
    table, found = "", 1
    for number, line in enumerate(text.splitlines(), start=1):
        header = re.match(r"\s*\[([^]]*)\]", line)
        key = re.match(r'\s*"?([\w.]+)"?\s*=', line)
        if header:
            table = header[1].strip()
        name = f"{table}.{key[1]}".strip(".") if key else table
        if name == ".".join(path[:2]):
            return number
        if name == path[0]:
            found = number
    return found
