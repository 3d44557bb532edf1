"""Episodes in which teacher and learner drive in turns."""

import numpy as np
import pytest
from horf_cli.algorithms import SettingError
from horf_cli.config import Protocol, TrainConfig
from horf_cli.environments import EnvSettings, make_env
from horf_cli.lesson import Lesson
from horf_cli.metrics import read_metrics
from horf_cli.training import train

from sb3_bayes_dsac.common.taught_buffer import TAKEN_ACTION, TEACHER_ACTION

SETTINGS = EnvSettings(scene="doorway")
VELOCITIES = EnvSettings(action_layer="joint_velocity")
STILL = np.zeros(6, np.float32)


def lesson(seed, steps):
    """What was done and what the teacher would have done while the learner stands still."""
    env = Lesson(make_env(SETTINGS))
    env.reset(seed=seed)
    infos = [env.step(STILL)[-1] for _ in range(steps)]
    env.close()
    return (np.stack([info[key] for info in infos]) for key in (TAKEN_ACTION, TEACHER_ACTION))


def test_both_drive_and_the_teacher_always_speaks():
    taken, teacher = lesson(seed=0, steps=300)
    assert taken.shape == teacher.shape == (300, 6)
    assert taken.dtype == np.float32
    learner_drove = (taken == STILL).all(axis=1)
    assert 0.1 < learner_drove.mean() < 0.9
    assert np.abs(teacher).max(axis=1).min() > 0.0
    assert np.abs(teacher).max() <= 1.0


def test_turns_are_long_enough_to_show_something():
    taken, _ = lesson(seed=0, steps=300)
    learner_drove = (taken == STILL).all(axis=1)
    changes = np.flatnonzero(np.diff(learner_drove.astype(int)))
    assert np.diff(changes).min() >= 20


@pytest.mark.parametrize("changes", [{"guided_steps": 10}, {"env": VELOCITIES}])
def test_what_the_teacher_cannot_teach_is_refused(changes):
    with pytest.raises(SettingError):
        TrainConfig(algo="dagger", steps=50, **changes).check()


def test_a_run_from_beginning_to_end(tmp_path):
    config = TrainConfig(
        algo="dagger",
        env=SETTINGS,
        steps=60,
        settings={"batch_size": 8},
        protocol=Protocol(every=60, episodes=1, final_episodes=1),
    )
    result = train(config, tmp_path / "run")
    assert (result.status, result.steps, result.episodes) == ("finished", 60, 1)
    names = set(read_metrics(tmp_path / "run")["name"].to_pylist())
    assert "train/imitation_loss" in names
