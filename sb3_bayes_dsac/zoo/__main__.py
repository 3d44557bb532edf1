"""`python -m sb3_bayes_dsac.zoo train|enjoy ...`: rl_zoo3 with the algorithms of this package."""

from __future__ import annotations

import sys

from sb3_bayes_dsac.zoo.registration import register, with_hyperparameters


def main() -> None:
    """Run one of rl_zoo3's commands; its own options follow the command's name.

    Raises:
        SystemExit: rl_zoo3 is not installed, or no command is named.
    """
    if len(sys.argv) < 2:
        raise SystemExit("name a command of rl_zoo3: train, enjoy, plot_train, ...")
    try:
        register()
    except ImportError as error:
        raise SystemExit(f"{error}; install the extra: pip install 'horf[zoo]'") from error
    from rl_zoo3 import cli

    sys.argv = with_hyperparameters(sys.argv)
    cli.main()


if __name__ == "__main__":
    main()
