"""Encoder of depth images for any SB3 algorithm with Dict observations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import torch as th
from gymnasium import spaces
from stable_baselines3.common.preprocessing import (
    get_flattened_obs_dim,
    is_image_space,
    preprocess_obs,
)
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.type_aliases import PyTorchObs
from torch import nn

from sb3_bayes_dsac.common.patches import PATCH, PatchConvolution
from sb3_bayes_dsac.errors import ArgumentError

# Channels of the three convolutions.
CHANNELS: Final = (16, 32, 32)
# At which a vector of `multi_scale` is squashed, in its own unit.
SCALES: Final = (0.1, 1.0)


def is_image(space: spaces.Space[Any]) -> bool:
    """Whether a space holds images: three dimensions (channels, height, width), any dtype."""
    return is_image_space(space, normalized_image=True)


def image_keys(space: spaces.Dict) -> list[str]:
    """Keys of a Dict space that hold images."""
    return [key for key, subspace in space.spaces.items() if is_image(subspace)]


class FlattenPixels(nn.Module):
    """Pixel after pixel, (B, C, H, W) -> (B, H * W * C).

    Where the channels come last in memory, nothing moves, neither here nor in the gradient.
    """

    def forward(self, images: th.Tensor) -> th.Tensor:
        """Flatten all but the first dimension."""
        return images.permute(0, 2, 3, 1).flatten(1)


def depth_cnn(shape: tuple[int, ...], features_dim: int) -> nn.Sequential:
    """Convolutions from one image stack of shape (C, H, W) to `features_dim` numbers in [-1, 1].

    The paper names a CNN with a 32-length output and no more. Layer norm and tanh at the end
    keep the features at the scale of the vectors beside them, however the critics' gradient
    moves the convolutions; this is usual where a critic trains an encoder.
    """
    first, second, third = CHANNELS
    convolutions = nn.Sequential(
        PatchConvolution(shape[0], first),
        nn.Conv2d(first, second, kernel_size=3, stride=2, padding=1),
        nn.ReLU(inplace=True),
        nn.Conv2d(second, third, kernel_size=3, stride=2, padding=1),
        nn.ReLU(inplace=True),
        FlattenPixels(),
    )
    with th.no_grad():
        flat = convolutions(th.zeros(1, *shape)).shape[1]
    head = (nn.Linear(flat, features_dim), nn.LayerNorm(features_dim), nn.Tanh())
    return nn.Sequential(*convolutions, *head)


class DepthEncoder(BaseFeaturesExtractor):
    """Encodes the images of a Dict observation and appends its vectors.

    Give it to any SB3 algorithm, so that all of them see alike:
    `SAC("MultiInputPolicy", env, policy_kwargs=dict(features_extractor_class=DepthEncoder))`.

    Args:
        observation_space: Dict with at least one image key, a Box of shape (C, H, W) with H and W
            of at least 4 pixels. All other keys are flattened.
        features_dim: Numbers per image; 32 in the paper (its z_t).
        multi_scale: Keys of vectors that are also given squashed, tanh(x / 0.1) and tanh(x): for
            a deviation of metres that has to become one of centimetres.

    Raises:
        ArgumentError: Not a Dict, no image among its keys, an image that is too small, or a key
            that the space does not have.
    """

    def __init__(
        self,
        observation_space: spaces.Space[Any],
        features_dim: int = 32,
        multi_scale: Sequence[str] = (),
    ) -> None:
        if not isinstance(observation_space, spaces.Dict) or not image_keys(observation_space):
            cure = "DepthEncoder needs a Dict with an image, a Box of shape (C, H, W)"
            raise ArgumentError("observation_space", observation_space, cure)
        subspaces = observation_space.spaces
        images = image_keys(observation_space)
        vectors = [key for key in subspaces if key not in images]
        if not set(multi_scale) <= set(vectors):
            raise ArgumentError("multi_scale", multi_scale, f"give some of {vectors}")
        copies = {key: 1 + len(SCALES) * (key in multi_scale) for key in vectors}
        n_vector = sum(get_flattened_obs_dim(subspaces[key]) * copies[key] for key in vectors)
        super().__init__(observation_space, len(images) * features_dim + n_vector)
        self.vectors, self.multi_scale = vectors, list(multi_scale)
        self.cnns = nn.ModuleDict()
        for key in images:
            shape = subspaces[key].shape
            if shape is None or min(shape[1:]) < PATCH:
                raise ArgumentError(f"observation_space[{key!r}]", shape, "needs H, W of 4 or more")
            self.cnns[key] = depth_cnn(shape, features_dim)

    def forward(self, observations: dict[str, th.Tensor]) -> th.Tensor:
        """Features of observations, shape (B, features_dim of this encoder).

        Args:
            observations: Preprocessed by SB3, or with images still as bytes.
        """
        encoded = [cnn(observations[key]) for key, cnn in self.cnns.items()]
        vectors = [observations[key].flatten(1) for key in self.vectors]
        fine = [observations[key].flatten(1) for key in self.multi_scale]
        squashed = [th.tanh(vector / scale) for vector in fine for scale in SCALES]
        return th.cat([*encoded, *vectors, *squashed], dim=1)


def encode(
    extractor: BaseFeaturesExtractor,
    observations: PyTorchObs,
    space: spaces.Space[Any],
    *,
    normalize_images: bool,
) -> th.Tensor:
    """Preprocess observations and encode them, shape (B, features_dim).

    As SB3 does it, but a `DepthEncoder` gets images as bytes: turning them into floats between 0
    and 1 beforehand costs as much as a convolution.

    Args:
        extractor: The encoder.
        observations: As a replay buffer gives them.
        space: Their space.
        normalize_images: Whether images are divided by 255.
    """
    images: dict[str, th.Tensor] = {}
    if isinstance(extractor, DepthEncoder) and normalize_images:
        assert isinstance(space, spaces.Dict)
        assert isinstance(observations, dict)
        bytes_keys = [key for key in extractor.cnns if is_image_space(space[key])]
        images = {key: observations[key] for key in bytes_keys}
        observations = {key: observations[key] for key in space if key not in images}
        space = spaces.Dict({key: space[key] for key in observations})
    ready = preprocess_obs(observations, space, normalize_images=normalize_images)
    features: th.Tensor = extractor(ready | images if isinstance(ready, dict) else ready)
    return features
