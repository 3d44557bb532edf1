import subprocess
import sys

import pytest

HEAVY = "torch,pybullet,rerun,numpy,gymnasium,matplotlib"

PROGRAM = """
import sys
from horf_cli.main import main
try:
    main()
finally:
    print("HEAVY", [name for name in sys.argv[-1].split(",") if name in sys.modules])
"""


@pytest.mark.parametrize(
    "command",
    [
        [],
        ["demo"],
        ["train"],
        ["compare"],
        ["report"],
        ["export"],
        ["evaluate"],
        ["replay"],
        ["scenes"],
        ["doctor"],
    ],
)
def test_help_answers_without_heavy_imports(command):
    # The names come last, behind an end of options that --help never reaches.
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *command, "--help", "--", HEAVY],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Usage: " in done.stdout
    assert done.stdout.strip().endswith("HEAVY []")


def test_bare_command_shows_help_and_is_wrong_usage(horf):
    result = horf()
    assert result.exit_code == 2
    assert "evaluate" in result.output


def test_version(horf):
    from importlib.metadata import version

    result = horf("--version")
    assert result.exit_code == 0
    assert result.stdout.strip() == f"horf {version('horf')}"


def test_top_level_name_is_not_cli(tmp_path):
    code = "import importlib.util as u; print(u.find_spec('cli'), bool(u.find_spec('horf_cli')))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["None", "True"]
