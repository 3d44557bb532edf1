import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import numpy as np
import pytest
from horf_cli.config import TrainConfig
from horf_cli.environments import EnvSettings
from horf_cli.metrics import EVALUATIONS, METRICS, PartWriter
from horf_cli.report import write_report
from horf_cli.report_numbers import final_rows, pairs
from horf_cli.run_results import group, read_run
from horf_cli.runs import Manifest, RunFolder

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@pytest.fixture
def make_run(tmp_path):
    """A made-up run: two evaluations while it learns, and one at the end with a given return."""

    def make(algo, seed, value, *, ratio=None, status="finished", parts=3, bias=0.25, seconds=36):
        config = TrainConfig(
            algo=algo, seed=seed, steps=100, replay_ratio=ratio, env=EnvSettings(scene="room")
        )
        run = RunFolder.create(tmp_path / "runs", config)
        run.write(Manifest.of(config))
        for folder in (METRICS, EVALUATIONS):
            writer = PartWriter(run.path / folder)
            for part in range(1, parts + 1):
                place = {"step": 100 * part // parts, "wall_time": seconds * part / parts}
                if folder == METRICS:
                    names = ("episode/return", "episode/success", "train/critic_loss")
                    writer.add([{**place, "name": name, "value": 0.5} for name in names])
                else:
                    last = part == parts and status == "finished"
                    writer.add([*episodes(place, "paper", value / 2)])
                    writer.add([*episodes(place, "validation", value)] if last else [])
                writer.flush()
        (run.path / "q_bias.json").write_text(json.dumps({"normalized_mean": bias}))
        (run.path / "recordings").mkdir()
        (run.path / "recordings" / "final.rrd").touch()
        run.finish(status, 100, "it broke" if status == "failed" else "")
        return run.path

    return make


def episodes(place, protocol, value):
    for k, failure in enumerate(("", "collision", "stuck", "timeout")):
        yield {
            **place,
            **{"protocol": protocol, "episode": k, "instance": k, "return": value + k - 1.5},
            **{"length": 10, "success": not failure, "failure": failure},
        }


@pytest.fixture
def paths(make_run):
    """Two algorithms, three seeds each; TD3's are 10 better, and one of them failed."""
    runs = [make_run("sac", seed, float(seed)) for seed in range(3)]
    runs += [make_run("td3", seed, 10.0 + seed) for seed in range(2)]
    return [*runs, make_run("td3", 2, 0.0, status="failed")]


def test_numbers(paths):
    sac, td3 = final_rows(group([read_run(path) for path in paths]))
    assert (sac.runs, td3.runs) == ("3 of 3", "2 of 3")
    assert (sac.mean_return, td3.mean_return) == ("1.0", "10.5")
    assert sac.iqm_return == "1.0 [0.0, 2.0]"
    assert sac.success.startswith("25 [")
    assert (sac.outcomes, td3.outcomes) == ("3 / 3 / 3 / 3", "2 / 2 / 2 / 2")
    assert sac.speed == "2.8"  # 100 steps in 36 s
    assert sac.q_bias == "+0.25"
    (pair,) = pairs(group([read_run(path) for path in paths]))
    assert (pair.better, pair.worse, pair.probability) == ("sac", "td3", 0.0)


def test_curves_are_at_common_places(paths):
    run = read_run(paths[1])
    points = run.evaluation_points("return")
    np.testing.assert_array_equal(points.step, [33, 66, 100])
    np.testing.assert_allclose(points.hours, [12 / 3600, 24 / 3600, 36 / 3600])
    np.testing.assert_allclose(points.value, 0.5)
    assert len(run.training_points("episode/return").step) == 3


def test_markdown_says_what_was_done_and_what_is_weak(paths, tmp_path):
    out = tmp_path / "report"
    files = write_report(paths, out, command="horf compare --seeds 0-2", failed={"td3 seed 2": "x"})
    assert [file.name for file in files] == ["report.html", "report.md"]
    text = (out / "report.md").read_text()
    assert "Which learns best: sac or td3, after 100 environment steps in scene room" in text
    assert "horf compare --seeds 0-2" in text
    assert "Fewer than 5 finished runs of sac, td3" in text
    assert f"Not finished: {paths[-1]}" in text
    assert "- td3 seed 2: x" in text
    assert "it broke" in text
    assert "| sac > td3 | 0.00 |" in text
    for path in paths:
        assert f"../runs/{path.relative_to(tmp_path / 'runs')}/recordings/final.rrd" in text
    figures = re.findall(r"\]\((\w+\.svg)\)", text)
    assert figures == ["curves.svg", "training.svg", "final.svg", "improvement.svg", "q_bias.svg"]
    assert all((out / name).read_text().startswith("<?xml") for name in figures)
    assert "torch" in text


def test_runs_that_overlap_nowhere_in_time_are_drawn_one_by_one(make_run, tmp_path):
    runs = [make_run("sac", seed, 0.0, parts=1, seconds=36 + seed) for seed in range(2)]
    write_report(runs, tmp_path / "report")
    assert "curves.svg" in (tmp_path / "report" / "report.md").read_text()


def test_replay_ratios_are_groups_of_their_own(make_run, tmp_path):
    runs = [make_run("redq", 0, value, ratio=ratio) for ratio, value in ((1.0, 0.0), (20.0, 5.0))]
    write_report(runs, tmp_path / "report")
    assert "| redq, ratio 20 | 1 of 1 |" in (tmp_path / "report" / "report.md").read_text()
    assert (tmp_path / "report" / "replay_ratio.svg").exists()


def test_damaged_parts_are_named(paths, tmp_path):
    part = paths[0] / METRICS / "part-000002.parquet"
    part.write_bytes(b"damaged")
    write_report(paths, tmp_path / "report")
    assert f"{part}: damaged" in (tmp_path / "report" / "report.md").read_text()


def test_report_of_folders_of_runs(horf, paths, tmp_path):
    result = horf("report", tmp_path / "runs", "--out", tmp_path / "report")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "report" / "report.md").read_text().count("final.rrd]") == len(paths)
    nothing = horf("report", tmp_path / "report")
    assert nothing.exit_code == 1
    assert "no run in there" in nothing.stderr


class Page(HTMLParser):
    """What a browser made of the report."""

    def __init__(self, text):
        super().__init__()
        self.text, self.addresses, self.images = "", [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.addresses += [found[name] for name in ("src", "href") if found.get(name)]
        if tag == "img":
            self.images.append(found)

    def handle_data(self, data):
        self.text += data


def test_html_needs_nothing_else(paths, tmp_path):
    html, _ = write_report(paths, tmp_path / "report", command="horf <x>")
    page = Page(html.read_text())
    assert len(page.images) == 5
    assert all(image["src"].startswith("data:image/svg+xml;base64,") for image in page.images)
    assert not [address for address in page.addresses if re.match(r"(https?:)?//", address)]
    assert "horf <x>" in page.text


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")
def test_a_browser_shows_text_and_figures_without_errors(paths, tmp_path):
    html, _ = write_report(paths, tmp_path / "report")
    # Tells what the browser made of the pictures, in the page that it prints.
    probe = "<script>onload = () => document.body.append('DRAWN ' + [...document.images].map("
    probe += "image => image.complete && image.naturalWidth > 300).join())</script>"
    probed = html.with_name("probed.html")
    probed.write_text(html.read_text().replace("</body>", f"{probe}</body>"))
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr"]
    profile = f"--user-data-dir={tmp_path / 'profile'}"
    done = subprocess.run(
        [CHROMIUM, *options, profile, "--virtual-time-budget=5000", "--dump-dom", probed.as_uri()],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    page = Page(done.stdout)
    assert "Probability of improvement" in page.text
    assert "DRAWN true,true,true,true,true" in page.text
    assert "CONSOLE" not in done.stderr
