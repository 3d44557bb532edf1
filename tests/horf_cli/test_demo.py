from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from horf_env.recording import summarise
from horf_env.scenes import SCENES


@pytest.mark.usefixtures("short_episodes")
def test_demo_makes_a_table_a_recording_and_a_picture_a_scene(horf, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("demo").mkdir()
    result = horf("demo", "--instance", 2)
    assert result.exit_code == 0, result.output
    assert list(Path("demo").iterdir()) == []  # not touched
    for name in SCENES:
        assert name in result.stdout
        found = summarise(Path(f"demo-2/{name}-2.rrd"))
        assert found.properties["scene"] == name
        picture = imread(f"demo-2/{name}-2.png")
        assert min(picture.shape[:2]) > 600
        # Walls, obstacles, paths, pictures: not a blank page.
        colours = (255 * picture[..., :3]).astype(int) @ [1, 256, 65536]
        assert len(np.unique(colours)) > 500
