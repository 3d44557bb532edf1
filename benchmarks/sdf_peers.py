"""Rivals of the distance query: a Bernstein robot distance field and brute force."""

from __future__ import annotations

import igl
import numpy as np
import torch

from horf_env.robot import ConvexPart
from horf_env.sdf import RobotSdf
from horf_env.types import FloatArray

DEGREE = 8  # Bernstein functions along each axis
_FIT_POINTS = 8000


class BernsteinField:
    """Robot distance field of Li et al. (2023) as described there: 8^3 Bernstein functions a link.

    Weights by least squares on exact distances within the link's box and 0.1 m around it; outside
    the box the distance to the box is added. In float32, no gradients. Own implementation.
    """

    def __init__(self, sdf: RobotSdf, boxes: FloatArray) -> None:
        """Fit all links."""
        self._lower = torch.tensor(boxes[:, 0] - 0.1, dtype=torch.float32)[:, None]
        self._size = torch.tensor(boxes[:, 1] - boxes[:, 0] + 0.2, dtype=torch.float32)[:, None]
        rng, weights = np.random.default_rng(0), []
        for k in range(len(boxes)):
            unit = rng.uniform(size=(_FIT_POINTS, 3))
            points = self._lower[k].numpy() + unit * self._size[k].numpy()
            target = torch.tensor(sdf.link_distance(k, points))
            basis = _basis(torch.tensor(unit)[None])[0]
            weights.append(torch.linalg.lstsq(basis, target[:, None]).solution)
        self._weights = torch.stack(weights).float()

    @torch.no_grad()
    def nearest(self, points: FloatArray, poses: FloatArray) -> torch.Tensor:
        """Least distance of each link to a cloud (N, 3), shape (B,)."""
        T = torch.tensor(poses, dtype=torch.float32)
        world = torch.tensor(points, dtype=torch.float32)
        local = (world[None] - T[:, None, :3, 3]) @ T[:, :3, :3]
        unit = (local - self._lower) / self._size
        inside = unit.clamp(0.0, 1.0)
        beyond = ((unit - inside) * self._size).norm(dim=-1)
        distance = (_basis(inside) @ self._weights)[..., 0] + beyond
        least: torch.Tensor = distance.min(dim=1).values
        return least


def _basis(unit: torch.Tensor) -> torch.Tensor:
    """Products of Bernstein polynomials, (B, N, 3) -> (B, N, DEGREE^3)."""
    n = DEGREE - 1
    k = torch.arange(DEGREE, dtype=unit.dtype)
    binomial = torch.exp(
        torch.lgamma(torch.tensor(n + 1.0, dtype=unit.dtype))
        - torch.lgamma(k + 1)
        - torch.lgamma(n - k + 1)
    )
    t = unit[..., None]
    axes = binomial * t**k * (1 - t) ** (n - k)
    x, y, z = axes.unbind(dim=-2)
    product = x[..., :, None, None] * y[..., None, :, None] * z[..., None, None, :]
    return product.flatten(start_dim=-3)


def brute_force(
    parts: tuple[tuple[ConvexPart, ...], ...], points: FloatArray, poses: FloatArray
) -> FloatArray:
    """Least unsigned distance of each body by libigl, shape (B,)."""
    least: FloatArray = np.full(len(parts), np.inf)
    for k, body in enumerate(parts):
        local = (points - poses[k, :3, 3]) @ poses[k, :3, :3]
        for part in body:
            squared, _, _ = igl.point_mesh_squared_distance(local, part.vertices, part.faces)
            least[k] = min(least[k], squared.min())
    distances: FloatArray = np.sqrt(least)
    return distances
