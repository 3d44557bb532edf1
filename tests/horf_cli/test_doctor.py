from horf_cli.checks import check_package
from packaging.requirements import Requirement


def test_a_sound_installation_passes_and_the_real_thing_runs(horf_json):
    found = horf_json("doctor")
    checks = {check["name"]: check for check in found["checks"]}
    assert all(check["ok"] for check in checks.values())
    assert {"torch", "pybullet", "rerun-sdk", "pin", "environment"} <= set(checks)
    assert "depth 64x48" in checks["environment"]["detail"]
    assert "QP solved" in checks["environment"]["detail"]


def test_a_missing_package_fails_with_the_cure(horf, monkeypatch):
    monkeypatch.setattr(
        "horf_cli.checks.requirements", lambda: [Requirement("horf-needs-this>=1.0")]
    )
    result = horf("doctor")
    assert result.exit_code == 1
    assert 'pip install "horf-needs-this>=1.0"' in result.stdout


def test_an_old_package_fails_with_both_versions():
    check = check_package(Requirement("numpy>=99"))
    assert not check.ok
    assert ">=99" in check.detail


def test_a_package_that_does_not_import_fails(monkeypatch):
    def broken(name):
        raise OSError("libmissing.so")

    monkeypatch.setattr("importlib.import_module", broken)
    check = check_package(Requirement("numpy"))
    assert not check.ok
    assert "libmissing.so" in check.detail
