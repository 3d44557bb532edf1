from pathlib import Path

from matplotlib.image import imread

from horf_env.scenes import SCENES


def test_all_families_with_their_instances(horf_json):
    rows = horf_json("scenes")["scenes"]
    assert [row["scene"] for row in rows] == list(SCENES)
    assert all(row["test"] == 50 for row in rows)


def test_pictures(horf_json, tmp_path):
    folder = Path(horf_json("scenes", "--out", tmp_path / "pictures")["pictures"])
    for name in SCENES:
        assert imread(folder / f"{name}.png").std() > 0.05
