"""`python -m sb3_bayes_dsac.zoo train|enjoy ...`: rl_zoo3 with the algorithms of this package."""

from __future__ import annotations

import importlib
import sys
from typing import Final

from sb3_bayes_dsac.zoo.registration import register, with_hyperparameters

# Functions and modules of rl_zoo3. Its own command line is not used: it imports the plots, too,
# which need more packages.
COMMANDS: Final = ("train", "enjoy")


def main() -> None:
    """Run one of rl_zoo3's commands; its own options follow the command's name.

    Raises:
        SystemExit: No such command, or rl_zoo3 is not installed.
    """
    command = sys.argv[1] if len(sys.argv) > 1 else None
    if command not in COMMANDS:
        raise SystemExit(f"expected one of {', '.join(COMMANDS)} first, got {command}")
    try:
        register()
    except ImportError as error:
        raise SystemExit(f"{error}; install the extra: pip install 'horf[zoo]'") from error
    program, _, *options = with_hyperparameters(sys.argv)
    # rl_zoo3 reads the options from there.
    sys.argv = [program, *options]
    getattr(importlib.import_module(f"rl_zoo3.{command}"), command)()


if __name__ == "__main__":
    main()
