"""The policy that this package ships."""

from __future__ import annotations

from pathlib import Path
from typing import Final

POLICY: Final = Path(__file__).parent / "shipped" / "horf.safetensors"
"""A file of `horf export`; its manifest, `horf.json` beside it, says how it came about."""
