from __future__ import annotations

import pytest
from gymnasium import spaces

from sb3_bayes_dsac.common.temperature import parse_target_entropy, parse_temperature
from sb3_bayes_dsac.errors import ArgumentError


@pytest.mark.parametrize(
    ("ent_coef", "expected"),
    [
        ("auto", (1.0, True)),
        ("auto_0.1", (0.1, True)),
        (0.2, (0.2, False)),
        (0, (0.0, False)),
        ("0.05", (0.05, False)),
    ],
)
def test_notations(ent_coef: str | float, expected: tuple[float, bool]) -> None:
    assert parse_temperature(ent_coef) == expected


@pytest.mark.parametrize("ent_coef", ["aut", "auto_0", "auto_-1", "auto_x", -0.1, float("nan")])
def test_nonsense_is_named(ent_coef: str | float) -> None:
    with pytest.raises(ArgumentError, match="ent_coef="):
        parse_temperature(ent_coef)


@pytest.mark.parametrize(
    ("target_entropy", "expected"), [("auto", -6.0), (-2, -2.0), ("-3.5", -3.5)]
)
def test_target_entropy(target_entropy: str | float, expected: float) -> None:
    assert parse_target_entropy(target_entropy, spaces.Box(-1, 1, (2, 3))) == expected
