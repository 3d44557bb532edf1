"""Unseen ground that seen sides enclose."""

import numpy as np

from horf_env.perception.enclosed import enclosed

SIDE = 30


def cells(*boxes):
    """Those within (first row, last row, first column, last column)."""
    found = np.zeros((SIDE, SIDE), dtype=bool)
    for first, last, left, right in boxes:
        found[first : last + 1, left : right + 1] = True
    return found


# A box of 10 x 8 cells: its first row and its last column of cells were seen.
FIRST, LAST = (10, 10, 10, 17), (10, 19, 17, 17)
UNSEEN = cells((11, 29, 0, 16), (20, 29, 17, 29))


def test_a_box_reaches_as_far_as_the_two_sides_that_were_seen():
    found = enclosed(cells(FIRST, LAST), UNSEEN, 14)
    box = cells((11, 19, 10, 16))
    assert (found | ~box).all()
    assert (found & ~box).sum() <= 1


def test_a_box_of_which_one_side_was_seen_is_half_as_deep_as_that_is_wide():
    found = enclosed(cells(FIRST), UNSEEN, 14)
    assert np.flatnonzero(found.any(axis=1)).tolist() == [11, 12, 13]
    assert np.flatnonzero(found.any(axis=0)).tolist() == list(range(11, 17))


def test_a_box_may_be_turned_by_half_a_right_angle():
    sides = np.zeros((SIDE, SIDE), dtype=bool)
    steps = np.arange(10)
    sides[5 + steps, 15 + steps] = sides[5 + steps, 15 - steps] = True
    found = enclosed(sides, ~sides, 20)
    assert found[[17, 19, 21, 23], 15].all()
    assert not found[26, 15]


def test_sides_that_are_too_far_away_enclose_nothing():
    assert not enclosed(cells(FIRST, LAST), UNSEEN, 3)[19, 10]


def test_ground_that_was_seen_ends_what_is_enclosed():
    across = cells((14, 14, 0, 29))
    behind = cells((15, 19, 10, 14))
    assert enclosed(cells(FIRST, LAST), UNSEEN, 14)[behind].all()
    found = enclosed(cells(FIRST, LAST), UNSEEN & ~across, 14)
    assert found.any()
    assert not found[behind | across].any()
