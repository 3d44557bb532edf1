"""Errors of this package: each names the thing that is wrong, what was expected and the cure."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class HorfEnvError(Exception):
    """Root of all errors that `horf_env` raises on purpose."""


class UnknownNameError(HorfEnvError, ValueError):
    """A name that is not among the valid ones.

    Attributes:
        kind: What the name stands for ("scene", "action layer", ...).
        name: The name that was given.
        valid: All valid names, sorted.
        nearest: The valid name closest in spelling, or None.
    """

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.valid = sorted(valid)
        close = difflib.get_close_matches(str(name), self.valid, n=1, cutoff=0.4)
        self.nearest = close[0] if close else None
        hint = f"; did you mean {self.nearest!r}?" if self.nearest else "."
        super().__init__(f"unknown {kind} {name!r}{hint} Valid: {', '.join(self.valid)}.")


class SettingError(HorfEnvError, ValueError):
    """A setting that makes no sense.

    Attributes:
        name: Name of the setting.
        value: What it was set to.
        expected: What it should be.
    """

    def __init__(self, name: str, value: object, expected: str) -> None:
        self.name = name
        self.value = value
        self.expected = expected
        super().__init__(f"setting {name!r}: expected {expected}, got {value!r}")


class MissingAssetError(HorfEnvError, FileNotFoundError):
    """A mesh or data file that the package needs is not on this machine.

    Attributes:
        path: What was looked for.
    """

    def __init__(self, path: str, cure: str) -> None:
        self.path = path
        super().__init__(f"missing {path}: {cure}")


class RobotFileError(HorfEnvError, ValueError):
    """A URDF that cannot be used.

    Attributes:
        path: The file.
    """

    def __init__(self, path: str, problem: str) -> None:
        self.path = path
        super().__init__(f"{path}: {problem}")


class GeometryError(HorfEnvError, ValueError):
    """Geometry of a robot that no distance can be measured to.

    Attributes:
        link: Link that it belongs to.
    """

    def __init__(self, link: str, problem: str) -> None:
        self.link = link
        super().__init__(f"link {link!r}: {problem}")


class CloudError(HorfEnvError, ValueError):
    """A point cloud of the wrong shape, or with a coordinate that is not finite."""


class QueryError(HorfEnvError, ValueError):
    """An argument of a distance query that does not fit the robot."""


class ConfigurationError(HorfEnvError, ValueError):
    """A configuration of the wrong shape, not finite, or outside the joint limits."""


class SceneFileError(HorfEnvError, ValueError):
    """A scene file that cannot be used.

    Attributes:
        source: File (or other origin) of the scene.
        field: Path of the offending field, as "boxes[3].half_extents".
        expected: What the field should hold.
    """

    def __init__(self, source: str, field: str, expected: str) -> None:
        self.source = source
        self.field = field
        self.expected = expected
        super().__init__(f"{source}: field {field!r}: expected {expected}")


class InvalidActionError(HorfEnvError, ValueError):
    """An action of the wrong shape or with a non-finite number; nothing has moved."""


class SolverError(HorfEnvError, RuntimeError):
    """A QP solver, asked for by name, found no solution."""
