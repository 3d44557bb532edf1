"""Make the packaged instances: draw scenes, keep those that a planner proves feasible.

Run it with the extra `bench` installed:

    python benchmarks/make_instances.py [SCENE ...] [--output FOLDER]

It continues where the files in the folder end, so it may be interrupted, and one process a scene
may run at the same time. What it accepts depends on the seeds alone, not on the machine's speed. A
scene is accepted if the whole motion is free of collisions and its base path is within 20 % of the
length that the paper's Table 1 reports; no compared method has a say.
"""

from __future__ import annotations

import argparse
import logging
import os
from dataclasses import replace
from pathlib import Path

from feasibility.proof import Prover
from pydantic import TypeAdapter

import horf_env.scenes
from horf_env.scenes.families import SCENES
from horf_env.scenes.instances import (
    SPLITS,
    Instance,
    InstanceFile,
    parse_instances,
    random_scene,
    scene_hash,
)

PATH_BAND = (0.8, 1.2)
"""Accepted lengths of the base's path, as factors of the paper's."""

PACKAGED = Path(horf_env.scenes.__file__).parent / "instances"

_LOG = logging.getLogger("make_instances")
_RECORD = TypeAdapter(Instance)


def main() -> None:
    """Complete the files of the given scenes, the test splits first."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", default=list(SCENES), metavar="SCENE")
    parser.add_argument("--output", type=Path, default=PACKAGED, help="folder of the files")
    arguments = parser.parse_args()
    prover = Prover()
    for split in SPLITS:
        for name in arguments.scenes:
            complete(prover, name, split, arguments.output / f"{name}.json")


def complete(prover: Prover, name: str, split: str, path: Path) -> None:
    """Add instances to a split of one file until it has as many as `SPLITS` says."""
    file = parse_instances(path.read_bytes(), source=str(path)) if path.exists() else InstanceFile()
    found: tuple[Instance, ...] = getattr(file, split)
    first_seed, size = SPLITS[split]
    seed = found[-1].seed + 1 if found else first_seed
    while len(found) < size:
        instance = proven(prover, name, seed, frozen=split == "test")
        if instance is not None:
            found = (*found, instance)
            write(path, replace(file, **{split: found}))
            _LOG.info("%s %s %d/%d: seed %d", name, split, len(found), size, seed)
        seed += 1


def proven(prover: Prover, name: str, seed: int, *, frozen: bool) -> Instance | None:
    """The instance of a seed if it is feasible, with the scene itself if `frozen`."""
    scene = random_scene(name, seed)
    target = SCENES[name].base_path
    proof = prover.prove(scene, seed + 1, (PATH_BAND[0] * target, PATH_BAND[1] * target))
    if proof is None:
        return None
    path_length = round(proof.path_length, 3)
    return Instance(seed, path_length, scene_hash(scene), scene if frozen else None)


def write(path: Path, file: InstanceFile) -> None:
    """Replace a file in one step: one instance a line, so that changes can be read."""
    splits = [
        f'"{split}": [\n' + ",\n".join(map(_line, getattr(file, split))) + "\n]" for split in SPLITS
    ]
    temporary = path.with_suffix(".tmp")
    temporary.write_text("{\n" + ",\n".join(splits) + "\n}\n")
    os.replace(temporary, path)


def _line(instance: Instance) -> str:
    return _RECORD.dump_json(instance, exclude_none=True).decode()


if __name__ == "__main__":
    main()
