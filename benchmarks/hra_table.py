"""Write the table of docs/results.md for HRA from the trial files of `horf evaluate --out`.

python benchmarks/hra_table.py benchmarks/results/hra_*.csv
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

from horf_cli.statistics import share

SCENES = ("aisle", "room", "forest", "doorway")


def cell(rows: list[dict[str, str]], failure: str) -> str:
    """A rate with its 95 % Wilson interval."""
    return str(share(sum(row["failure"] == failure for row in rows), len(rows)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="+", type=Path)
    print("| preset, perception | scene | n | success | collision | timeout |")
    print("|---|---|---|---|---|---|")
    for path in parser.parse_args().files:
        _, preset, perception = path.stem.split("_")
        with path.open() as file:
            trials = list(csv.DictReader(file))
        for scene in SCENES:
            rows = [row for row in trials if row["scene"] == scene]
            rates = " | ".join(cell(rows, failure) for failure in ("", "collision", "timeout"))
            print(f"| `{preset}`, `{perception}` | {scene} | {len(rows)} | {rates} |")


if __name__ == "__main__":
    main()
