"""Noise of a stereo depth camera, made where it arises: in the disparity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from horf_env.perception.camera import CameraModel, DepthImage

# RealSense D435. Baseline [m]: data sheet.
_BASELINE = 0.05
# Focal length [px] at 848x480, the mode that Intel recommends for depth: 645 px at 1280 columns.
_FOCAL_LENGTH = 427.0
# Standard deviation of the matching [px]: Intel's figure for textured surfaces.
_SUBPIXEL_SD = 0.08
# The sensor reports disparity in steps of this size [px].
_DISPARITY_STEP = 1.0 / 32.0


@dataclass(frozen=True)
class DisparityNoise:
    """Gaussian noise and rounding of the disparity d = focal_length * baseline / z.

    The error of the depth grows with its square: 4 mm at 1 m, 15 mm at 2 m, 60 mm at 4 m. A pixel
    is one sample of the sensor's 848x480 image, whatever the size of the simulated one. Not in the
    paper, which does not say what noise its simulated camera has.

    Attributes:
        baseline: Distance between the two imagers [m].
        focal_length: Focal length of the sensor at 848x480 [px].
        subpixel_sd: Standard deviation of the disparity [px].
        disparity_step: Resolution of the disparity [px].
    """

    baseline: float = _BASELINE
    focal_length: float = _FOCAL_LENGTH
    subpixel_sd: float = _SUBPIXEL_SD
    disparity_step: float = _DISPARITY_STEP

    def apply(
        self, depth: DepthImage, model: CameraModel, generator: np.random.Generator
    ) -> DepthImage:
        """A noisy copy of a depth image.

        Args:
            depth: Ideal depth in m, shape (H, W); 0 = invalid, stays invalid.
            model: The camera, for its range: what the noise throws out of it becomes invalid.
            generator: Source of randomness; draws one number a pixel, valid or not.

        Returns:
            Depth in m, shape (H, W).
        """
        scale = self.focal_length * self.baseline
        valid = depth > 0.0
        disparity = scale / np.where(valid, depth, 1.0)
        disparity = disparity + generator.normal(0.0, self.subpixel_sd, depth.shape)
        disparity = np.round(disparity / self.disparity_step) * self.disparity_step
        measured = valid & (disparity > 0.0)
        noisy = np.where(measured, scale / np.where(measured, disparity, 1.0), 0.0)
        return model.within_range(noisy.astype(np.float32))
