"""Compiled search for the cloud points that matter to each body: nearest, and most critical.

For each body: bound the distance of every point from below (bounding box) and from both sides
(fields), evaluate exactly only what can be the nearest, then pick further witness points in the
order of what is left of their distance after braking, well apart from each other.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from horf_env.sdf.convex import convex_distance
from horf_env.types import FloatArray, IntArray


@njit(cache=True)
def exact_distance(
    point: FloatArray,
    planes: FloatArray,
    triangles: FloatArray,
    spheres: FloatArray,
    part_start: IntArray,
    first: int,
    last: int,
    normal: FloatArray,
) -> float:
    """Distance of a point to a union of convex parts `first` to `last` - 1, exact outside.

    Inside, it is the distance to the surface of the part in which the point is deepest.
    """
    best = np.inf
    part_normal = np.empty(3)
    for part in range(first, last):
        distance = convex_distance(
            point, planes, triangles, spheres, part_start[part], part_start[part + 1], part_normal
        )
        if distance < best:
            best = distance
            normal[:] = part_normal
    return best


@njit(cache=True)
def _interpolate(
    px: float,
    py: float,
    pz: float,
    part: int,
    level: int,
    values: FloatArray,
    origins: FloatArray,
    cells: FloatArray,
) -> float:
    """Trilinear value of one grid; inf outside of it: grids are never extrapolated."""
    top = values.shape[2] - 1
    x = (px - origins[part, level, 0]) / cells[part, level, 0]
    y = (py - origins[part, level, 1]) / cells[part, level, 1]
    z = (pz - origins[part, level, 2]) / cells[part, level, 2]
    if not (0.0 <= x < top and 0.0 <= y < top and 0.0 <= z < top):
        return np.inf
    i, j, k = int(x), int(y), int(z)
    x, y, z = x - i, y - j, z - k
    near = (values[part, level, i, j, k] * (1 - z) + values[part, level, i, j, k + 1] * z) * (
        1 - y
    ) + (values[part, level, i, j + 1, k] * (1 - z) + values[part, level, i, j + 1, k + 1] * z) * y
    far = (
        values[part, level, i + 1, j, k] * (1 - z) + values[part, level, i + 1, j, k + 1] * z
    ) * (1 - y) + (
        values[part, level, i + 1, j + 1, k] * (1 - z)
        + values[part, level, i + 1, j + 1, k + 1] * z
    ) * y
    return near * (1 - x) + far * x


@njit(cache=True)
def _bounds(
    x: float,
    y: float,
    z: float,
    first: int,
    last: int,
    low: float,
    high: float,
    values: FloatArray,
    origins: FloatArray,
    cells: FloatArray,
) -> tuple[float, float]:
    """Tighten the bounds of the distance to a body by its fields, where they reach [m]."""
    lower, upper = np.inf, np.inf
    for part in range(first, last):
        level = 0
        value = _interpolate(x, y, z, part, 0, values, origins, cells)
        if value == np.inf:
            level = 1
            value = _interpolate(x, y, z, part, 1, values, origins, cells)
        if value == np.inf:
            return low, high
        cx, cy, cz = cells[part, level, 0], cells[part, level, 1], cells[part, level, 2]
        slack = 0.5 * np.sqrt(cx * cx + cy * cy + cz * cz)
        lower, upper = min(lower, value - slack), min(upper, value)
    return max(lower, low), upper


@njit(cache=True)
def _beyond(x: float, lower: float, upper: float) -> float:
    """Signed distance of a coordinate from an interval, 0 inside."""
    return x - min(max(x, lower), upper)


@njit(cache=True, fastmath={"nnan", "nsz", "contract"})
def _approach(
    axes: FloatArray,
    pose: FloatArray,
    box: FloatArray,
    twist: FloatArray,
    braking: float,
    local: FloatArray,
    distance: FloatArray,
    remaining: FloatArray,
) -> None:
    """Write all points in the frame of a body, and how far its box is from them, now and stopped.

    Without branches and with the coordinates apart, so that it compiles to vector instructions;
    that takes minima that need not care about NaN (the points are known to be finite).

    Args:
        axes: World coordinates, shape (3, N), m.
        pose: T_world_body, shape (4, 4).
        box: Lower and upper corner, shape (2, 3), m.
        twist: Velocity of the body (linear; angular) in its own frame, shape (6,).
        braking: Deceleration [m/s^2].
        local: Written, shape (3, N), m.
        distance: Written: distance from the box, shape (N,), m.
        remaining: Written: the same less the way towards the point while braking, shape (N,), m.
    """
    r00, r01, r02, t0 = pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3]
    r10, r11, r12, t1 = pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3]
    r20, r21, r22, t2 = pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3]
    x0, y0, z0 = box[0, 0], box[0, 1], box[0, 2]
    x1, y1, z1 = box[1, 0], box[1, 1], box[1, 2]
    v0, v1, v2, w0, w1, w2 = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    per_speed = 0.5 / braking
    for i in range(len(distance)):
        dx, dy, dz = axes[0, i] - t0, axes[1, i] - t1, axes[2, i] - t2
        x = r00 * dx + r10 * dy + r20 * dz
        y = r01 * dx + r11 * dy + r21 * dz
        z = r02 * dx + r12 * dy + r22 * dz
        local[0, i], local[1, i], local[2, i] = x, y, z
        ox, oy, oz = _beyond(x, x0, x1), _beyond(y, y0, y1), _beyond(z, z0, z1)
        squared = ox * ox + oy * oy + oz * oz
        # Speed towards the point times the distance from it.
        towards = (
            (v0 + w1 * z - w2 * y) * ox + (v1 + w2 * x - w0 * z) * oy + (v2 + w0 * y - w1 * x) * oz
        )
        towards = max(towards, 0.0)
        distance[i] = np.sqrt(squared)
        remaining[i] = distance[i] - per_speed * towards * towards / max(squared, 1e-12)


@njit(cache=True)
def find_witnesses(
    points: FloatArray,
    poses: FloatArray,
    twists: FloatArray,
    first_body: int,
    planes: FloatArray,
    triangles: FloatArray,
    spheres: FloatArray,
    part_start: IntArray,
    body_start: IntArray,
    boxes: FloatArray,
    values: FloatArray,
    origins: FloatArray,
    cells: FloatArray,
    field_reach: float,
    cutoff: float,
    spacing: float,
    braking: float,
    distances: FloatArray,
    indices: IntArray,
    normals: FloatArray,
) -> None:
    """Fill the witness points of all bodies; places without a point keep inf, -1 and 0.

    Args:
        points: Cloud in the world, shape (N, 3), m.
        poses: T_world_body, shape (B, 4, 4).
        twists: Velocity of each body (linear; angular) in its own frame, shape (B, 6).
        first_body: Bodies before this one are passed over.
        planes: See `BodyGeometry`.
        triangles: See `BodyGeometry`.
        spheres: See `BodyGeometry`.
        part_start: See `BodyGeometry`.
        body_start: See `BodyGeometry`.
        boxes: See `BodyGeometry`.
        values: See `Fields`.
        origins: See `Fields`.
        cells: See `Fields`.
        field_reach: Padding of the widest fields; bounding boxes alone serve beyond it [m].
        cutoff: Points that stay farther than this from a body even if it brakes only now [m] are
            left out.
        spacing: Least distance between two witness points of a body [m].
        braking: Deceleration behind the order of the witness points [m/s^2]; inf for none.
        distances: Written, shape (B, K), m; the nearest first.
        indices: Written, index into the cloud, shape (B, K).
        normals: Written, gradient of the distance with respect to the point, world axes (B, K, 3).
    """
    n, count = len(points), distances.shape[1]
    axes = points.T.copy()
    everywhere, far, remaining = np.empty((3, n)), np.empty(n), np.empty(n)
    local, normal = np.empty((n, 3)), np.empty(3)
    near, lower, key = np.empty(n, np.int64), np.empty(n), np.empty(n)
    for b in range(first_body, len(poses)):
        R, box = poses[b, :3, :3], boxes[b]
        diagonal = np.sqrt(((box[1] - box[0]) ** 2).sum())
        first, last = body_start[b], body_start[b + 1]
        found, best_upper, chosen, least = 0, np.inf, -1, np.inf
        _approach(axes, poses[b], box, twists[b], braking, everywhere, far, remaining)
        for i in range(n):
            if remaining[i] > cutoff:
                continue
            length = far[i]
            x, y, z = everywhere[0, i], everywhere[1, i], everywhere[2, i]
            local[found, 0], local[found, 1], local[found, 2], near[found] = x, y, z, i
            low, high = (length if length > 0.0 else -np.inf), length + diagonal
            if length < field_reach:
                low, high = _bounds(x, y, z, first, last, low, high, values, origins, cells)
            if high < best_upper:
                best_upper, chosen = high, found
            lower[found], key[found] = low, low - length + remaining[i] if length > 0.0 else low
            found += 1
        if chosen >= 0:
            least = exact_distance(
                local[chosen], planes, triangles, spheres, part_start, first, last, normal
            )
        for m in range(found):
            if lower[m] >= least:
                continue
            distance = exact_distance(
                local[m], planes, triangles, spheres, part_start, first, last, normal
            )
            if distance < least:
                least, chosen = distance, m
        for k in range(count):
            if k > 0:
                chosen = _next(local, key, found, chosen, spacing)
            if chosen < 0:
                break
            distances[b, k] = exact_distance(
                local[chosen], planes, triangles, spheres, part_start, first, last, normal
            )
            indices[b, k] = near[chosen]
            for j in range(3):
                normals[b, k, j] = R[j, 0] * normal[0] + R[j, 1] * normal[1] + R[j, 2] * normal[2]


@njit(cache=True)
def _next(local: FloatArray, key: FloatArray, found: int, chosen: int, spacing: float) -> int:
    """Take all points within the spacing of the chosen one out of the running; name the next.

    Returns:
        Place of the least key that is left, -1 if none is.
    """
    x, y, z = local[chosen, 0], local[chosen, 1], local[chosen, 2]
    key[chosen] = np.inf
    lowest, following = np.inf, -1
    for m in range(found):
        if key[m] == np.inf:
            continue
        dx, dy, dz = local[m, 0] - x, local[m, 1] - y, local[m, 2] - z
        if dx * dx + dy * dy + dz * dz < spacing * spacing:
            key[m] = np.inf
        elif key[m] < lowest:
            lowest, following = key[m], m
    return following


@njit(cache=True)
def within(
    points: FloatArray,
    poses: FloatArray,
    planes: FloatArray,
    triangles: FloatArray,
    spheres: FloatArray,
    part_start: IntArray,
    body_start: IntArray,
    boxes: FloatArray,
    tolerance: float,
    inside: np.ndarray,
) -> None:
    """Mark the points that are nearer than the tolerance [m] to any body."""
    local, normal = np.empty(3), np.empty(3)
    for i in range(len(points)):
        inside[i] = False
        for b in range(len(poses)):
            dx = points[i, 0] - poses[b, 0, 3]
            dy = points[i, 1] - poses[b, 1, 3]
            dz = points[i, 2] - poses[b, 2, 3]
            outside = 0.0
            for j in range(3):
                local[j] = poses[b, 0, j] * dx + poses[b, 1, j] * dy + poses[b, 2, j] * dz
                outside += _beyond(local[j], boxes[b, 0, j], boxes[b, 1, j]) ** 2
            if outside > tolerance * tolerance:
                continue
            distance = exact_distance(
                local,
                planes,
                triangles,
                spheres,
                part_start,
                body_start[b],
                body_start[b + 1],
                normal,
            )
            if distance < tolerance:
                inside[i] = True
                break
