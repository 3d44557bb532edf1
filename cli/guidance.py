"""Demonstrations in the replay buffer, before a policy acts for the first time.

Not in the paper. A goal is ten metres of clutter away, and chance does not get there. The oracle
shows how; where actions correct a planner, that planner does, uncorrected.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from horf_env.planners import OraclePlanner, Planner
from horf_env.types import FloatArray

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
    """What has been shown.

    Attributes:
        steps: Transitions in the buffer.
        episodes: Episodes.
        successes: Those that reached the goal.
    """

    steps: int
    episodes: int
    successes: int


class Uncorrected:
    """Leaves the planner that is corrected as it is; see `horf_env.planners.Planner`."""

    action_layer = "sdf_qp"

    def reset(self, env: Env) -> None:
        """Nothing to forget."""

    def act(self, observation: dict[str, np.ndarray]) -> FloatArray:
        """No correction."""
        return np.zeros(6)


def guide(
    model: OffPolicyAlgorithm, config: TrainConfig, check: Callable[[], None] = lambda: None
) -> Guided:
    """Let a planner drive training instances and store what happens.

    Args:
        model: Its replay buffer is filled.
        config: The run; with one environment.
        check: Called after each step; raises to stop.
    """
    env, rng = make_env(config.env), np.random.default_rng([config.seed, config.guided_steps])
    env.reset(seed=int(rng.integers(2**31)))  # an own stream of instances
    planner = Uncorrected() if config.env.action_mode == "residual" else OraclePlanner()
    steps = episodes = successes = 0
    try:
        while steps < config.guided_steps:
            infos = []
            for info in islice(_episode(model, env, planner, rng), config.guided_steps - steps):
                infos.append(info)
                check()
            steps, episodes = steps + len(infos), episodes + 1
            successes += bool(infos[-1]["is_success"])
    finally:
        env.close()
    return Guided(steps, episodes, successes)


def _episode(
    model: OffPolicyAlgorithm, env: Env, planner: Planner, rng: np.random.Generator
) -> Iterator[dict[str, Any]]:
    """Drive one episode; gives the info of each step after it was stored."""
    places = deque[np.ndarray](maxlen=_STILL_STEPS)
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
