"""Whole-body motion of a mobile manipulator as a Gymnasium environment."""
