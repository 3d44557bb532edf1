"""Names of code in the documentation exist, and its examples run."""

from __future__ import annotations

import pkgutil
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

DOCS = Path(__file__).parents[1] / "docs"
NAME = re.compile(r"`((?:sb3_bayes_dsac|horf_env|horf_cli)(?:\.\w+)+)`")
FOUND = sorted(
    {(page, name) for page in DOCS.rglob("*.md") for name in NAME.findall(page.read_text())}
)
# Fenced Python of a page, and what makes it short and windowless.
EXAMPLE = re.compile(r"```python\n(.*?)```", re.DOTALL)
SHORTER = {"10_000": "105", ', render_mode="human"': "", "while True:": "for _ in range(3):"}


def test_there_are_names() -> None:
    assert len(FOUND) > 10


@pytest.mark.parametrize(("page", "name"), FOUND, ids=lambda value: getattr(value, "name", value))
def test_name_exists(page: Path, name: str) -> None:
    pkgutil.resolve_name(name)


@pytest.mark.parametrize("page", ["bayes_dsac", "dsac_t", "redq"])
def test_example_of_an_algorithm_runs(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (code,) = EXAMPLE.findall((DOCS / "algorithms" / f"{page}.md").read_text())
    for long, short in SHORTER.items():
        assert long in code
        code = code.replace(long, short)
    namespace: dict[str, Any] = {}
    exec(code, namespace)
    assert namespace["model"]._n_updates > 0
    assert np.isfinite(namespace["reward"])
