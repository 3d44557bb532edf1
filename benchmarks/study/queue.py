"""Doing the runs of a study one after the other, those that are not done yet."""

from __future__ import annotations

import argparse
import datetime
import fnmatch
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import torch as th
from horf_cli.provenance import git_revision, machine, versions

from .records import path_of, write
from .runs import Run
from .training import train


def work_off(runs: Iterable[Run], folder: Path, *, only: str, budget: float) -> None:
    """Do the runs that are missing, in the order given.

    Args:
        runs: The study.
        folder: Where its records are.
        only: Do only runs that have this in their name, which may hold wildcards.
        budget: No further run is begun after so many seconds.
    """
    th.set_num_threads(1)
    begin = time.monotonic()
    # Read once: the files on disk may change while a long study goes on.
    origin = {"machine": machine(), "versions": versions(), "revision": git_revision()}
    for run in runs:
        if time.monotonic() - begin > budget:
            _say(f"budget used up before {run.name}")
            return
        if path_of(folder, run).exists() or not fnmatch.fnmatch(run.name, f"*{only}*"):
            continue
        _say(f"begin {run.name}")
        rows, end = train(run)
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        write(folder, run, rows, {"end": end, "finished": now, "threads": 1, **origin})
        _say(f"{end}: {run.name}")


def main(description: str, runs: Iterable[Run], folder: Path) -> None:
    """Command line of a study."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--only", default="", help="runs with this in their name (wildcards)")
    parser.add_argument("--budget-minutes", type=float, default=float("inf"))
    parser.add_argument("--out", type=Path, default=folder)
    arguments = parser.parse_args()
    budget = 60.0 * arguments.budget_minutes
    work_off(runs, arguments.out, only=arguments.only, budget=budget)


def _say(text: str) -> None:
    now = datetime.datetime.now().isoformat(timespec="seconds")
    print(f"{now} {text}", file=sys.stderr, flush=True)
