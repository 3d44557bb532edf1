"""What does each rule of the local map do? The camera's map, each rule off alone.

HRA stands still most of the time, so that the rules hardly matter to it; `mapped` drives.

Validation instances, seed = instance number; each episode is a row in a CSV file, as in
`safety.py`, and a run that was stopped goes on where it was. All runs of a scene come before the
next scene, so that a budget that ends leaves runs that can be compared. One thread.

    python benchmarks/map_rules.py [--planner hra] [--scenes room forest] [--instances 10]
"""

from __future__ import annotations

import argparse
import itertools
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from safety import Run, perform, read
from safety_table import summarise

from horf_env.control import PRESETS
from horf_env.perception import CameraModel, FrameSettings, MapSettings
from horf_env.planners import PLANNERS
from horf_env.scenes import SCENES
from horf_env.task import STEP

FOLDER = Path("benchmarks/results/map_rules")
_FRAMES = 5  # the paper's
_IMAGES = ((32, 24), (64, 48), (96, 72))  # pixels; the default's is the first run


def _map(**changes: Any) -> Run:
    return Run({"memory": replace(MapSettings(), **changes)})


def _control(**changes: Any) -> Run:
    return Run({"control": replace(PRESETS["default"], **changes)})


def _images() -> dict[str, Run]:
    default = CameraModel()
    return {
        f"image_{width}x{height}": Run({"camera": replace(default, width=width, height=height)})
        for width, height in _IMAGES
        if (width, height) != (default.width, default.height)
    }


RUNS: dict[str, Run] = {
    "default": Run(),
    "no_fill_above": _map(fill_above=False),
    "no_fill_behind": _map(fill_behind=0.0),
    "fill_far_behind": _map(fill_behind=0.3),
    "no_free_goal": _map(free_goal=False),
    "no_guard_unseen": _control(guard_unseen=False),
    "no_guard_reach": _control(guard_reach=False),
    "no_guard_at_all": _map(guard_unseen_ground=False),
    "no_carving": _map(carving=False),
    # The map, but it forgets as fast as the paper's memory.
    "no_history": _map(history=_FRAMES * STEP),
    "five_frames": Run({"memory": FrameSettings(frames=_FRAMES)}),
    **_images(),
}


def main() -> None:
    """Do what is left, print the table and write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--planner", choices=list(PLANNERS), default="mapped")
    parser.add_argument("--runs", nargs="+", choices=list(RUNS), default=list(RUNS))
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES), default=list(SCENES))
    parser.add_argument("--instances", type=int, default=10, help="of each scene")
    parser.add_argument("--budget", type=float, default=np.inf, help="s; then no episode is begun")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of rows and summary")
    arguments = parser.parse_args()
    deadline = time.monotonic() + arguments.budget
    folder = arguments.out / arguments.planner
    for scene, name in itertools.product(arguments.scenes, arguments.runs):
        perform(
            replace(RUNS[name], planner=PLANNERS[arguments.planner]),
            folder / f"{name}.csv",
            split="validation",
            instances=arguments.instances,
            scenes=[scene],
            deadline=deadline,
        )
    rows = {name: read(folder / f"{name}.csv") for name in RUNS}
    summarise(rows, folder / "summary.json")


if __name__ == "__main__":
    main()
