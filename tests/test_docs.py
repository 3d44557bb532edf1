"""Names of code in the documentation exist."""

from __future__ import annotations

import pkgutil
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
NAME = re.compile(r"`((?:sb3_bayes_dsac|horf_env|horf_cli)(?:\.\w+)+)`")
FOUND = sorted(
    {(page, name) for page in DOCS.rglob("*.md") for name in NAME.findall(page.read_text())}
)


def test_there_are_names() -> None:
    assert len(FOUND) > 10


@pytest.mark.parametrize(("page", "name"), FOUND, ids=lambda value: getattr(value, "name", value))
def test_name_exists(page: Path, name: str) -> None:
    pkgutil.resolve_name(name)
