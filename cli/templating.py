"""The packaged Jinja templates, with the filters they use."""

from __future__ import annotations

import re
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

_TEX = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "³": "$^3$",
    "†": r"$\dagger$",
    **{character: f"\\{character}" for character in "&%$#_{}"},
}


def render(template: str, **values: Any) -> str:
    """Text of a packaged template.

    Args:
        template: Its file name; what it puts into HTML is escaped.
        values: What it is filled with; a missing one is an error.
    """
    environment = Environment(
        loader=PackageLoader("horf_cli"),
        autoescape=select_autoescape(["html.j2"]),
        undefined=StrictUndefined,
    )
    environment.filters["tex"] = _tex
    return environment.get_template(template).render(**values)


def _tex(text: str) -> str:
    """Text with LaTeX's special characters escaped."""
    return re.sub(r"[\\~^³†&%$#_{}]", lambda found: _TEX[found.group()], text)
