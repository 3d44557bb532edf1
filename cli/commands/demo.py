"""`horf demo`: the robot in all four scenes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .. import packaged
from ..options import Json

if TYPE_CHECKING:
    from horf_env.planners import Planner

    from ..episodes import Trial


def demo(
    out: Annotated[
        Path, typer.Option(help="Folder to make; a number is added to the name if it is taken.")
    ] = Path("demo"),
    instance: Annotated[int, typer.Option(min=0, help="Test instance of each scene.")] = 0,
    policy: Annotated[
        Path | None,
        typer.Option(help="A file of `horf export` or a run folder, instead of the packaged one."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Drive the robot through one instance of each scene: table, recordings, pictures.

    Watch a recording afterwards with `horf replay`.
    """
    from horf_env.scenes import SCENES, test_instance

    from ..console import notes, print_json, results
    from ..folders import new_folder
    from ..policies import load_policy
    from ..tables import trial_table

    for scene in SCENES:
        test_instance(scene, instance)  # a wrong number is refused before a folder is made
    path = policy or packaged.POLICY
    name, planner = path.stem, load_policy(path)
    folder = new_folder(out)
    trials = []
    with notes().status("loading") as status:
        for scene in SCENES:
            status.update(f"driving through scene {scene}")
            trials.append(_drive(name, planner, scene, instance, folder))
    if as_json:
        print_json({"folder": str(folder), "trials": [asdict(trial) for trial in trials]})
        return
    console = results()
    console.print(trial_table(trials, title=f"{name}, instance {instance} of each scene"))
    console.print(f"recordings (.rrd) and pictures (.png): {folder}")


def _drive(name: str, planner: Planner, scene: str, instance: int, folder: Path) -> Trial:
    from horf_env.recording import EpisodeRecorder
    from horf_env.robot import RobotState

    from ..environments import EnvSettings, make_env, reach_env
    from ..episodes import run_episode
    from ..path_figure import save_path_figure
    from ..recordings import save_recording

    recorder = EpisodeRecorder()
    states: list[RobotState] = []
    env = make_env(EnvSettings(scene=scene).for_planner(planner))
    trial = run_episode(
        env,
        planner,
        method=name,
        scene=scene,
        instance=instance,
        observers=[
            lambda inner: recorder.add(inner.record),
            lambda inner: states.append(inner.record.state),
        ],
    )
    stem = f"{scene}-{instance}"
    save_recording(recorder, env, trial, split="test", path=folder / f"{stem}.rrd")
    save_path_figure(folder / f"{stem}.png", scene=reach_env(env).scene, states=states, trial=trial)
    env.close()
    return trial
