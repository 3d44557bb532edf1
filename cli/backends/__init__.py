"""Where jobs run: in processes of this machine, or on a Ray cluster."""

from .backend import Backend, Outcome
from .choice import BACKENDS, make_backend

__all__ = ["BACKENDS", "Backend", "Outcome", "make_backend"]
