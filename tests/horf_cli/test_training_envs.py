"""Environments in which somebody else drives, too, can be brought back to where they were."""

import numpy as np
import pytest
from horf_cli.config import TrainConfig
from horf_cli.environments import EnvSettings
from horf_cli.training_envs import training_envs

SETTINGS = EnvSettings(scene="doorway")


@pytest.mark.parametrize("driver", [{"algo": "dagger"}, {"hand_over": 1.0}])
def test_the_episode_can_be_repeated(driver):
    config = TrainConfig(env=SETTINGS, steps=10, **driver)
    envs, copy = training_envs(config), training_envs(config)
    envs.seed(3)
    last = envs.reset()
    for _ in range(30):
        last = envs.step(np.full((1, 6), 0.2, np.float32))[0]
    assert copy.repeat(envs.episode_states(), last)
    envs.close()
    copy.close()
