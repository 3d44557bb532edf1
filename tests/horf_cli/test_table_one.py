import csv

import pytest
from horf_cli.table_formats import terminal_table, write_table
from horf_cli.table_one import paired_tests, paper_table, table_one
from rich.console import Console


@pytest.fixture
def trials(make_trial):
    """HRA succeeds in 9 of 10 trials, my_planner in none, both in the room."""

    def group(method, successes):
        return [
            make_trial("" if k < successes else "stuck", 6.0, method=method, seed=k)
            for k in range(10)
        ]

    return {("room", "hra"): group("hra", 9), ("room", "my_planner"): group("my_planner", 0)}


def cells(table, label):
    (row,) = [row for row in table.blocks[0].rows if row.label == label]
    return row.cells


def test_paper_prints_all_cells():
    found = paper_table()
    assert set(found) == {"aisle", "room", "forest", "doorway"}
    assert {len(metrics) for scene in found.values() for metrics in scene.values()} == {5}
    assert all(len(methods) == 7 for methods in found.values())


def test_layout_is_the_papers_with_its_figures_beside(trials):
    table = table_one(trials, ["a note"])
    assert table.columns == ["hra", "my_planner", "hra †"]
    assert [row.label for row in table.blocks[0].rows][:5] == [
        "TL of MM (m)",
        "TL of EE (m)",
        "AV (m/s)",
        "Total Runtime (s)",
        "Success Rate (%)",
    ]
    assert cells(table, "TL of MM (m)") == ["6.00", "-", "9.215"]
    assert cells(table, "Success Rate (%)") == ["90.0 [59.6, 98.2]", "0.0 [0.0, 27.8]", "70.12"]
    assert cells(table, "SPL")[2] == ""
    assert any("other scenes" in note for note in table.notes)
    assert table.notes[-1] == "a note"


def test_paired_test_takes_common_trials_only(trials):
    trials["room", "my_planner"] = trials["room", "my_planner"][:8]
    (test,) = paired_tests(trials)
    assert (test.baseline, test.method, test.pairs) == ("hra", "my_planner", 8)
    assert test.p_value == pytest.approx(2 * 0.5**8)
    assert cells(table_one(trials), "p, success as hra") == ["-", "0.00781", ""]


def test_a_method_that_failed_in_a_scene_leaves_its_cells_empty(trials, make_trial):
    trials["forest", "my_planner"] = [make_trial(method="my_planner", scene="forest")]
    table = table_one(trials)
    assert table.blocks[1].rows[0].cells[0] == "-"
    assert table.blocks[1].rows[0].cells[1] == "1.00"


def test_all_formats_hold_the_same_cells(trials, tmp_path):
    table = table_one(trials)
    markdown, values, latex = write_table(table, tmp_path)
    rows = list(csv.reader(values.open()))
    assert rows[0] == ["scene", "metric", *table.columns]
    assert rows[1] == ["room", "TL of MM (m)", "6.00", "-", "9.215"]
    assert "| room | TL of MM (m) | 6.00 | - | 9.215 |" in markdown.read_text()
    lines = [line for line in markdown.read_text().splitlines() if line.startswith("|")]
    assert {line.count("|") for line in lines} == {6}
    tex = latex.read_text()
    assert r"\multirow{15}{*}{room}" in tex
    assert r"& Success Rate (\%) & 90.0 [59.6, 98.2]" in tex
    assert r"my\_planner" in tex
    assert r"hra $\dagger$" in tex
    console = Console(width=160)
    with console.capture() as capture:
        console.print(terminal_table(table))
    assert "90.0 [59.6, 98.2]" in capture.get()
