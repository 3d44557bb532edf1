"""The scene families, one file each; a new one is a new file and one entry here."""

from __future__ import annotations

from types import MappingProxyType

from horf_env.scenes.families.aisle import Aisle
from horf_env.scenes.families.doorway import Doorway
from horf_env.scenes.families.family import SceneFamily
from horf_env.scenes.families.forest import Forest
from horf_env.scenes.families.room import Room

__all__ = ["SCENES", "Aisle", "Doorway", "Forest", "Room", "SceneFamily"]

SCENES: MappingProxyType[str, SceneFamily] = MappingProxyType(
    {family.name: family for family in (Aisle(), Room(), Forest(), Doorway())}
)
"""Name -> family, in the paper's order (Scene 1 to 4)."""
