"""Pydantic's findings about a scene, said as file, field and what was expected there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import ValidationError

from horf_env.errors import SceneFileError

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

WHOLE_FILE = "(whole file)"
"""Field path of an error that is not in one field."""

_EXPECTED = {
    "missing": "an entry here; it is missing",
    "unexpected_keyword_argument": "no such key; it is unknown here",
    "finite_number": "a finite number",
}


def scene_file_error(source: str, error: ValidationError) -> SceneFileError:
    """The first finding as an error of this package; the other fields are named only."""
    first, *others = error.errors(include_url=False)
    also = f" (wrong too: {', '.join(_path(o['loc']) for o in others)})" if others else ""
    return SceneFileError(source, _path(first["loc"]), _expected(first) + also)


def _path(location: tuple[int | str, ...]) -> str:
    """Path in the notation of the file, as "boxes[3].half_extents[0]"."""
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return path.removeprefix(".") or WHOLE_FILE


def _expected(finding: ErrorDetails) -> str:
    kind = finding["type"]
    if kind in _EXPECTED:
        return _EXPECTED[kind]
    if kind == "json_invalid":
        return f"valid JSON; {finding['ctx']['error']}"
    if kind == "too_long":
        return f"{finding['ctx']['max_length']} entries, got {finding['ctx']['actual_length']}"
    if kind == "value_error":
        return finding["msg"].removeprefix("Value error, ")
    return f"{finding['msg'].removeprefix('Input should be ')}, got {finding['input']!r}"
