import pytest
from horf_cli.exit_codes import CliError
from horf_cli.methods import Method, make_planner, parse_methods, planner_names

from horf_env.errors import UnknownNameError
from horf_env.planners import PLANNERS

PACKAGE = """
class Statue:
    action_layer = "sdf_qp"

    def reset(self, env):
        self.zero = env.action_space.sample() * 0

    def act(self, observation):
        return self.zero


class NoPlanner:
    pass
"""


@pytest.fixture
def added(tmp_path, monkeypatch):
    """Install a package with planners: its code, and metadata with entry points."""

    def install(points):
        (tmp_path / "my_planners.py").write_text(PACKAGE)
        info = tmp_path / "my_planners-2.1.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-planners\nVersion: 2.1\n")
        (info / "entry_points.txt").write_text("[horf.methods]\n" + points)
        monkeypatch.syspath_prepend(tmp_path)

    return install


@pytest.mark.usefixtures("short_episodes")
def test_a_planner_of_another_package_joins_the_table(added, horf_json, tmp_path):
    added("statue = my_planners:Statue\n")
    found = horf_json(
        *("evaluate", "--methods", "hra,statue", "--scenes", "room", "--trials", 1),
        *("--perception", "full", "--out", tmp_path / "out"),
    )
    hra, statue = found["summaries"]
    assert statue["method"] == "statue"
    assert statue["timeout"]["rate"] == 1.0
    assert "my-planners 2.1" in Method("statue").fingerprint
    assert [test["method"] for test in found["paired_tests"]] == ["statue"]
    assert hra["planning_p50"] > 0.0


def test_a_packaged_name_cannot_be_taken_over(added):
    added("hra = my_planners:Statue\n")
    with pytest.raises(CliError, match="hra is a packaged method"):
        planner_names()


@pytest.mark.parametrize("target", ["my_planners:NoPlanner", "my_planners:Nothing", "nowhere:X"])
def test_what_is_no_planner_is_refused_by_name(added, target):
    added(f"broken = {target}\n")
    with pytest.raises(CliError, match=f"method broken \\({target}\\)"):
        make_planner(Method("broken"))


def test_unknown_methods_are_refused_with_those_that_exist():
    with pytest.raises(UnknownNameError, match="hra") as error:
        parse_methods(["no_method"], [])
    assert set(PLANNERS) <= set(error.value.valid)


def test_policies_get_names(tmp_path):
    file = tmp_path / "p.safetensors"
    file.write_bytes(b"1")
    found = parse_methods(["hra", "horf", "hfss"], [str(file), f"hfss={file}"])
    assert found == [Method("hra"), Method("horf", str(file)), Method("hfss", str(file))]
    before = found[1].fingerprint
    file.write_bytes(b"2")
    assert found[1].fingerprint != before


def test_missing_policy_is_named(tmp_path):
    with pytest.raises(CliError, match=r"none\.safetensors"):
        parse_methods(["horf"], [str(tmp_path / "none.safetensors")])
