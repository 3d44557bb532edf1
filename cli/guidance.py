"""Demonstrations of the oracle in the replay buffer, before a policy acts for the first time.

Not in the paper. A goal is ten metres of clutter away, and chance does not get there.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from horf_env.planners import OraclePlanner

from .config import TrainConfig
from .environments import Env, make_env, reach_env

# Half of the episodes have this noise on their actions (standard deviation), so that the buffer
# also shows what follows after an error.
_NOISE, _NOISY_SHARE = 0.2, 0.5
# An episode ends if the gripper has moved less than this [m] in so many steps: there is nothing to
# be learnt from standing still.
_STILL, _STILL_STEPS = 0.02, 60


@dataclass(frozen=True)
class Guided:
    """What the oracle has shown.

    Attributes:
        steps: Transitions in the buffer.
        episodes: Episodes.
        successes: Those that reached the goal.
    """

    steps: int
    episodes: int
    successes: int


def guide(
    model: OffPolicyAlgorithm, config: TrainConfig, check: Callable[[], None] = lambda: None
) -> Guided:
    """Let the oracle drive training instances and store what happens.

    Args:
        model: Its replay buffer is filled.
        config: The run; with one environment.
        check: Called after each step; raises to stop.
    """
    env, rng = make_env(config.env), np.random.default_rng([config.seed, config.guided_steps])
    env.reset(seed=int(rng.integers(2**31)))  # an own stream of instances
    steps = episodes = successes = 0
    try:
        while steps < config.guided_steps:
            infos = []
            for info in islice(_episode(model, env, rng), config.guided_steps - steps):
                infos.append(info)
                check()
            steps, episodes = steps + len(infos), episodes + 1
            successes += bool(infos[-1]["is_success"])
    finally:
        env.close()
    return Guided(steps, episodes, successes)


def _episode(
    model: OffPolicyAlgorithm, env: Env, rng: np.random.Generator
) -> Iterator[dict[str, Any]]:
    """Drive one episode; gives the info of each step after it was stored."""
    planner, places = OraclePlanner(), deque[np.ndarray](maxlen=_STILL_STEPS)
    observation, _ = env.reset()
    planner.reset(env)
    noise = _NOISE if rng.random() < _NOISY_SHARE else 0.0
    done = False
    while not done:
        action = planner.act(observation) + noise * rng.standard_normal(6)
        action = np.clip(action, -1.0, 1.0).astype(np.float32)
        following, reward, terminated, truncated, info = env.step(action)
        places.append(reach_env(env).record.state.T_world_ee[:3, 3])
        still = len(places) == _STILL_STEPS and np.ptp(places, axis=0).max() < _STILL
        done = terminated or truncated or still
        info["TimeLimit.truncated"] = done and not terminated
        _store(model, observation, following, action, float(reward), done, info)
        observation = following
        yield info


def _store(
    model: OffPolicyAlgorithm,
    observation: dict[str, np.ndarray],
    following: dict[str, np.ndarray],
    action: np.ndarray,
    reward: float,
    done: bool,
    info: dict[str, Any],
) -> None:
    assert model.replay_buffer is not None
    model.replay_buffer.add(
        {key: part[None] for key, part in observation.items()},  # type: ignore[arg-type]
        {key: part[None] for key, part in following.items()},  # type: ignore[arg-type]
        action[None],
        np.array([reward]),
        np.array([done]),
        [info],
    )
