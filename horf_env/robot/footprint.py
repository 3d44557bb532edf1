"""Outline of the base on the floor."""

from __future__ import annotations

FOOTPRINT = (-0.35, 0.38, -0.25, 0.25)
"""(least x, greatest x, least y, greatest y) in the frame of the base [m]: the LD-60's body and the
camera on its front."""

BASE_HEIGHT = 0.38
"""Height of the LD-60's body [m]."""

GUARDED_HEIGHT = BASE_HEIGHT + 0.05
"""What hangs lower [m] the action layer keeps off the base: its height and the margin."""

CARRIED_HEIGHT = 1.15
"""What hangs higher [m] is above the arm in its ready pose."""
