"""What goes wrong on a real robot, by name: late, lost or bad images, and drives that do not obey.

Poses are the true ones throughout: an image that comes late carries the pose of its capture, and a
base that slips is still localised, as everywhere in this environment.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from types import MappingProxyType
from typing import Any

import gymnasium as gym
import numpy as np

from horf_env.errors import UnknownNameError
from horf_env.perception import DisparityNoise, Image
from horf_env.task import STEP
from horf_env.types import FloatArray

_DROPPED = 0.2  # part of the frames that get lost; no value in the literature, one in five is bad
_LATE = 0.1  # s
_NOISE_FACTOR = 3.0  # times the D435's noise in textured scenes: poor texture and poor light
_INVALID = 0.2  # part of the pixels
_SLIP = 0.05  # part of the base's motion that is lost
_LAG = 0.05  # s, time constant of the first-order lag of all nine drives


class Fault:
    """Nothing goes wrong. Faults override what they disturb.

    Attributes:
        rng: The environment's generator, set at each reset.
    """

    rng: np.random.Generator

    def reset(self, rng: np.random.Generator) -> None:
        """Start an episode with the environment's generator."""
        self.rng = rng

    def image(self, captured: Image) -> Image | None:
        """What arrives from the camera when it has captured an image; None if nothing does.

        The first image of an episode always arrives.
        """
        return captured

    def velocity(self, commanded: FloatArray) -> FloatArray:
        """What the drives make of a command, shape (9,), m/s and rad/s."""
        return commanded


class FrameDropped(Fault):
    """One in five images never arrives, at random."""

    def image(self, captured: Image) -> Image | None:
        """See `Fault`."""
        return None if self.rng.random() < _DROPPED else captured


class FrameLate(Fault):
    """Every image arrives 100 ms after its capture."""

    def reset(self, rng: np.random.Generator) -> None:
        """See `Fault`."""
        super().reset(rng)
        self._under_way: deque[Image] = deque()

    def image(self, captured: Image) -> Image | None:
        """See `Fault`."""
        self._under_way.append(captured)
        late = len(self._under_way) > round(_LATE / STEP)
        return self._under_way.popleft() if late else None


class DepthNoise(Fault):
    """Depth has three times the noise of a D435."""

    def __init__(self) -> None:
        ordinary = DisparityNoise()
        self._noise = DisparityNoise(subpixel_sd=_NOISE_FACTOR * ordinary.subpixel_sd)

    def image(self, captured: Image) -> Image | None:
        """See `Fault`."""
        depth = self._noise.apply(captured.depth, captured.model, self.rng)
        return captured.with_depth(depth)


class PixelsInvalid(Fault):
    """One in five pixels is invalid, others in each image."""

    def image(self, captured: Image) -> Image | None:
        """See `Fault`."""
        lost = self.rng.random(captured.depth.shape) < _INVALID
        return captured.with_depth(np.where(lost, 0.0, captured.depth).astype(np.float32))


class BaseSlip(Fault):
    """The base drives and turns 5 % slower than commanded."""

    def velocity(self, commanded: FloatArray) -> FloatArray:
        """See `Fault`."""
        slipped = commanded.copy()
        slipped[:2] *= 1.0 - _SLIP
        return slipped


class VelocityLag(Fault):
    """All nine drives follow their commands with a first-order lag of 50 ms."""

    def reset(self, rng: np.random.Generator) -> None:
        """See `Fault`."""
        super().reset(rng)
        self._velocity = np.zeros(9)

    def velocity(self, commanded: FloatArray) -> FloatArray:
        """See `Fault`."""
        reached = 1.0 - np.exp(-STEP / _LAG)
        self._velocity = self._velocity + reached * (commanded - self._velocity)
        return self._velocity


class FaultyEnv(gym.Wrapper[Any, Any, Any, Any]):
    """`horf/Reach-v0` with a fault."""

    def __init__(self, env: gym.Env[Any, Any], fault: Fault) -> None:
        """Put the fault into the environment; it takes effect at the next reset.

        Args:
            env: `horf/Reach-v0`, wrapped or not.
            fault: What goes wrong.
        """
        super().__init__(env)
        env.unwrapped.fault = fault  # type: ignore[attr-defined]


def _wrapper(fault: type[Fault]) -> Callable[[gym.Env[Any, Any]], FaultyEnv]:
    return lambda env: FaultyEnv(env, fault())


FAULTS: MappingProxyType[str, Callable[[gym.Env[Any, Any]], FaultyEnv]] = MappingProxyType(
    {
        "frame_dropped": _wrapper(FrameDropped),
        "frame_late": _wrapper(FrameLate),
        "depth_noise": _wrapper(DepthNoise),
        "pixels_invalid": _wrapper(PixelsInvalid),
        "base_slip": _wrapper(BaseSlip),
        "velocity_lag": _wrapper(VelocityLag),
    }
)
"""Name -> wrapper of the environment: `FAULTS["frame_late"](env)`."""


def with_fault(env: gym.Env[Any, Any], name: str) -> FaultyEnv:
    """The environment with the fault of that name.

    Raises:
        UnknownNameError: If there is none.
    """
    if name not in FAULTS:
        raise UnknownNameError("fault", name, FAULTS)
    return FAULTS[name](env)
