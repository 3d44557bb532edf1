"""The buffer of frame stacks against SB3's `DictReplayBuffer`, fed with the same stream."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
import torch as th
from gymnasium import spaces
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from sb3_bayes_dsac import BayesDSAC
from sb3_bayes_dsac.common.buffers import FrameStackReplayBuffer
from sb3_bayes_dsac.errors import ArgumentError, FrameStackError

ACTIONS = spaces.Box(-1, 1, (2,))
SHAPE = 2, 3


def space(frames: int) -> spaces.Dict:
    """An image stack between two other keys, one of them discrete."""
    return spaces.Dict(
        {
            "before": spaces.Discrete(3),
            "depth": spaces.Box(0, 255, (frames, *SHAPE), np.uint8),
            "state": spaces.Box(-1, 1, (4,)),
        }
    )


@dataclass
class Stream:
    """Environments that stack frames; grey values 0 to 1, so that frames often equal by chance."""

    frames: int
    n_envs: int
    rng: np.random.Generator
    reset_mode: str
    done_rate: float
    # Now and then an environment is reset without a word, as a second call of learn() does.
    silent_reset_rate: float = 0.05

    def __post_init__(self) -> None:
        self.depth = [self.first() for _ in range(self.n_envs)]

    def frame(self) -> NDArray[np.uint8]:
        return self.rng.integers(0, 2, SHAPE, np.uint8)

    def first(self) -> NDArray[np.uint8]:
        stack = np.stack([self.frame() for _ in range(self.frames)])
        if self.reset_mode == "repeat":
            stack[:] = stack[-1]
        if self.reset_mode == "zeros":
            stack[:-1] = 0
        return stack

    def observation(self, depth: list[NDArray[np.uint8]]) -> dict[str, NDArray[Any]]:
        state = self.rng.normal(size=(self.n_envs, 4)).astype(np.float32)
        before = self.rng.integers(0, 3, self.n_envs)
        return {"before": before, "depth": np.stack(depth), "state": state}

    def step(self) -> tuple[Any, ...]:
        """Arguments of `add`; the successor of a last step is the terminal observation."""
        obs = self.observation(self.depth)
        following = [np.concatenate([stack[1:], self.frame()[None]]) for stack in self.depth]
        next_obs = self.observation(following)
        done = self.rng.random(self.n_envs) < self.done_rate
        infos = [{"TimeLimit.truncated": bool(d and self.rng.random() < 0.5)} for d in done]
        reset = done | (self.rng.random(self.n_envs) < self.silent_reset_rate)
        self.depth = [
            self.first() if new else stack for new, stack in zip(reset, following, strict=True)
        ]
        action = self.rng.normal(size=(self.n_envs, 2))
        return obs, next_obs, action, self.rng.normal(size=self.n_envs), done, infos


def copied(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    copy: tuple[Any, ...] = pickle.loads(pickle.dumps(arguments))
    return copy


def assert_same_samples(one: DictReplayBuffer, other: DictReplayBuffer, **kwargs: Any) -> None:
    batches = []
    for buffer in (one, other):
        np.random.seed(0)
        batches.append(buffer.sample(64, **kwargs))
    a, b = batches
    for part, same_part in ((a.observations, b.observations), (a[2], b[2])):
        assert list(part) == list(same_part)
        for key, tensor in part.items():
            assert tensor.dtype == same_part[key].dtype
            assert th.equal(tensor, same_part[key]), key
    for name in ("actions", "dones", "rewards"):
        assert th.equal(getattr(a, name), getattr(b, name)), name


@settings(max_examples=50, deadline=None)
@given(
    size=st.integers(1, 24),
    n_envs=st.integers(1, 3),
    frames=st.integers(1, 5),
    steps=st.integers(1, 60),
    reset_mode=st.sampled_from(["repeat", "zeros", "distinct"]),
    done_rate=st.sampled_from([0.0, 0.1, 0.5, 1.0]),
    seed=st.integers(0, 2**16),
)
def test_samples_what_sb3_samples(
    size: int,
    n_envs: int,
    frames: int,
    steps: int,
    reset_mode: str,
    done_rate: float,
    seed: int,
) -> None:
    stream = Stream(frames, n_envs, np.random.default_rng(seed), reset_mode, done_rate)
    arguments: Any = (size, space(frames), ACTIONS, "cpu", n_envs)
    reference, buffer = DictReplayBuffer(*arguments), FrameStackReplayBuffer(*arguments)
    for _ in range(steps):
        transition = stream.step()
        reference.add(*copied(transition))
        buffer.add(*copied(transition))
        assert_same_samples(reference, buffer)


@pytest.mark.parametrize("episode", [1, 4, 100])
def test_no_place_is_lost_or_shared(episode: int) -> None:
    size, frames = 20, 5
    stream = Stream(frames, 1, np.random.default_rng(0), "repeat", 0.0, silent_reset_rate=0.0)
    buffer = FrameStackReplayBuffer(size, space(frames), ACTIONS, "cpu")
    for k in range(10 * size):
        if k % episode == 0:
            stream.depth = [stream.first()]
        buffer.add(*stream.step())
    # One frame a transition, one more for each episode that begins in the buffer, and the past of
    # the oldest transition.
    store = buffer._stores["depth"]
    assert store.stored <= size + -(-size // episode) + frames
    assert store.stored == len(np.unique(store._places))


def test_memory_of_a_large_buffer() -> None:
    depth = spaces.Dict({"depth": spaces.Box(0, 255, (5, 48, 64), np.uint8)})
    buffer = FrameStackReplayBuffer(100_000, depth, ACTIONS, "cpu")
    assert buffer.nbytes < 0.35e9
    assert DictReplayBuffer(10, depth, ACTIONS).observations["depth"].nbytes * 2e4 > 3e9


def test_warns_if_memory_will_not_do(monkeypatch: pytest.MonkeyPatch) -> None:
    free = SimpleNamespace(available=2_000)
    monkeypatch.setattr("psutil.virtual_memory", lambda: free)
    FrameStackReplayBuffer(10, space(3), ACTIONS)
    with pytest.warns(UserWarning, match="smaller buffer_size"):
        FrameStackReplayBuffer(100, space(3), ACTIONS)


def test_saved_and_loaded_buffer_goes_on() -> None:
    stream = Stream(3, 2, np.random.default_rng(0), "repeat", 0.2)
    arguments: Any = (30, space(3), ACTIONS, "cpu", 2)
    reference, buffer = DictReplayBuffer(*arguments), FrameStackReplayBuffer(*arguments)
    for k in range(60):
        transition = stream.step()
        reference.add(*copied(transition))
        buffer.add(*copied(transition))
        if k == 25:
            buffer = pickle.loads(pickle.dumps(buffer))
        assert_same_samples(reference, buffer)


def test_reset_forgets_everything() -> None:
    stream = Stream(3, 1, np.random.default_rng(0), "repeat", 0.2)
    arguments: Any = (8, space(3), ACTIONS, "cpu")
    reference, buffer = DictReplayBuffer(*arguments), FrameStackReplayBuffer(*arguments)
    for k in range(40):
        if k == 13:
            reference.reset()
            buffer.reset()
        transition = stream.step()
        reference.add(*copied(transition))
        buffer.add(*copied(transition))
        assert_same_samples(reference, buffer)


def test_normalised_as_sb3_normalises() -> None:
    class Still(gym.Env[Any, Any]):
        observation_space, action_space = space(2), ACTIONS

    env = VecNormalize(DummyVecEnv([Still]), norm_obs_keys=["state"])
    env.obs_rms["state"].mean += 2.0  # type: ignore[index]
    env.ret_rms.var = np.float64(9.0)
    stream = Stream(2, 1, np.random.default_rng(0), "repeat", 0.2)
    arguments: Any = (8, space(2), ACTIONS, "cpu")
    reference, buffer = DictReplayBuffer(*arguments), FrameStackReplayBuffer(*arguments)
    for _ in range(8):
        transition = stream.step()
        reference.add(*copied(transition))
        buffer.add(*copied(transition))
    assert_same_samples(reference, buffer, env=env)


def test_float_frames_keep_their_bits() -> None:
    floats = spaces.Dict({"depth": spaces.Box(-np.inf, np.inf, (2, *SHAPE))})
    buffer = FrameStackReplayBuffer(4, floats, ACTIONS, "cpu")
    stack = np.zeros((1, 2, *SHAPE), np.float32)
    stack[0, 1] = np.nan
    following = np.concatenate([stack[:, 1:], np.full((1, 1, *SHAPE), -0.0, np.float32)], axis=1)
    buffer.add(
        {"depth": stack}, {"depth": following}, np.zeros((1, 2)), np.zeros(1), np.zeros(1), [{}]
    )
    batch = buffer.sample(1)
    assert batch.observations["depth"].numpy().tobytes() == stack.tobytes()
    assert batch.next_observations["depth"].numpy().tobytes() == following.tobytes()


def test_refuses_what_is_no_stack() -> None:
    stream = Stream(3, 2, np.random.default_rng(0), "distinct", 0.0)
    buffer = FrameStackReplayBuffer(8, space(3), ACTIONS, "cpu", 2)
    obs, next_obs, *rest = stream.step()
    next_obs["depth"][1, 0] = 255 - next_obs["depth"][1, 0]
    with pytest.raises(FrameStackError, match=r"'depth'.* environment 1 .*DictReplayBuffer"):
        buffer.add(obs, next_obs, *rest)
    assert buffer.size() == 0
    assert buffer._stores["depth"].stored == 0


@pytest.mark.parametrize("keys", [["colour"], []])
def test_refuses_keys_that_are_not_there(keys: list[str]) -> None:
    with pytest.raises(ArgumentError, match=r"stacked_keys=.*'depth'"):
        FrameStackReplayBuffer(8, space(3), ACTIONS, stacked_keys=keys)


class Camera(gym.Env[dict[str, Any], Any]):
    """Frame stacks of 12 x 16 pixels, episodes of 7 steps that time out."""

    observation_space = spaces.Dict(
        {"depth": spaces.Box(0, 255, (3, 12, 16), np.uint8), "state": spaces.Box(-1, 1, (2,))}
    )
    action_space = ACTIONS

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[dict[str, Any], Any]:
        super().reset(seed=seed)
        self.steps = 0
        self.depth = np.repeat(self.frame(), 3, axis=0)
        return self.observation(), {}

    def frame(self) -> NDArray[np.uint8]:
        return self.np_random.integers(0, 256, (1, 12, 16), np.uint8)

    def observation(self) -> dict[str, Any]:
        return {"depth": self.depth.copy(), "state": self.np_random.normal(size=2)}

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        self.steps += 1
        self.depth = np.concatenate([self.depth[1:], self.frame()])
        return self.observation(), -float(np.square(action).sum()), False, self.steps >= 7, {}


def test_learns_as_with_sb3s_buffer() -> None:
    weights = []
    for cls in (DictReplayBuffer, FrameStackReplayBuffer):
        model = BayesDSAC(
            "MultiInputPolicy",
            DummyVecEnv([Camera, Camera]),
            replay_buffer_class=cls,
            policy_kwargs={"net_arch": [8]},
            buffer_size=60,
            learning_starts=20,
            batch_size=16,
            seed=0,
            device="cpu",
        )
        model.learn(60)
        # A second call resets the environments without an end of the episode.
        model.learn(40, reset_num_timesteps=False)
        weights.append(th.cat([p.flatten() for p in model.policy.parameters()]))
    assert th.equal(*weights)
