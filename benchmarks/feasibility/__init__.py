"""Proof that an instance can be solved, by planners that are none of the compared methods."""
