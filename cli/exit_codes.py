"""Which exit code an error stands for."""

from __future__ import annotations

RUNTIME_ERROR = 1
WRONG_USAGE = 2
SOME_JOBS_FAILED = 3
INTERRUPTED = 130


class CliError(Exception):
    """An error of the command line itself; its text names the thing and the cure."""


class UsageError(CliError):
    """Something that was typed, or stands in a file of settings, cannot be meant."""


def exit_code(error: Exception) -> int | None:
    """Exit code for an error, or None if it is a bug and deserves its trace.

    Args:
        error: What a command raised.
    """
    # Here and not above: this import costs what help should not cost.
    from horf_env.errors import HorfEnvError, UnknownNameError
    from horf_env.scenes.instances import InstanceIndexError

    if isinstance(error, UnknownNameError | InstanceIndexError | UsageError):
        return WRONG_USAGE
    if isinstance(error, BrokenPipeError):  # `horf ... | head`: typer knows what to do
        return None
    if isinstance(error, HorfEnvError | CliError | OSError | ImportError | MemoryError):
        return RUNTIME_ERROR
    return None


def one_line(error: Exception) -> str:
    """Text of an error without line breaks, and with the cure if a package is missing."""
    text = " ".join(str(error).split())
    if isinstance(error, ImportError):
        return f"{text}; `horf doctor` tells what to install"
    return text
