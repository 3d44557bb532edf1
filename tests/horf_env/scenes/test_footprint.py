from __future__ import annotations

import numpy as np
import pytest

from horf_env.scenes.families.footprint import Footprint, keep_apart


@pytest.mark.parametrize(
    ("other", "distance"),
    [
        (Footprint(3.0, 0.0, 1.0, 0.5), 1.0),  # side by side
        (Footprint(3.0, 2.0, 1.0, 0.5), np.hypot(1.0, 1.0)),  # corner to corner
        (Footprint(2.5, 0.0, 0.5, 0.5, np.pi / 4), 1.5 - np.sqrt(0.5)),  # corner to side
    ],
)
def test_gap_between_rectangles(other, distance):
    box = Footprint(0.0, 0.0, 1.0, 0.5)
    for a, b in ((box, other), (other, box)):
        assert keep_apart(a, b, distance - 1e-9)
        assert not keep_apart(a, b, distance + 1e-9)


@pytest.mark.parametrize(
    "other",
    [
        Footprint(0.5, 0.2, 1.0, 1.0, 0.3),  # partly covered
        Footprint(0.0, 0.0, 0.1, 0.1),  # inside
        Footprint(0.0, 0.0, 0.1, 5.0),  # a cross: no corner of one is in the other
    ],
)
def test_overlap_is_never_apart(other):
    box = Footprint(0.0, 0.0, 1.0, 0.5)
    assert not keep_apart(box, other, 0.0)
    assert not keep_apart(other, box, 0.0)
