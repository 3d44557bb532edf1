"""A complete collision-free motion from the start of a scene to its goal, or nothing.

The motion is: fold the arm, drive on a polyline in the plane (turning on the spot at its corners),
turn, unfold the arm to the goal. A robot that can do that can solve the instance; whoever moves
base and arm together can do it in less time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np
from scipy.spatial.transform import Rotation

from feasibility.motion import MIN_CLEARANCE, clearance, is_clear, whole_motion
from feasibility.planning import Space, densify, length, rrt_connect
from feasibility.tucked import (
    TUCKED_ARM,
    ForbiddenAreas,
    can_drive,
    can_turn,
    forbidden_areas,
    tucked_sizes,
)
from horf_env.robot import MobileManipulator
from horf_env.robot.inverse_kinematics import arm_ik
from horf_env.robot.limits import ARM_LOWER, ARM_READY, ARM_UPPER
from horf_env.scenes.scene import Scene
from horf_env.simulation import PyBulletWorld
from horf_env.types import FloatArray

GOAL_CLEARANCE = 0.02
"""Least clearance of the whole robot at the goal, m."""

_REACH = (0.4, 0.95)
"""Horizontal distance of the base's axis from the goal, m: nearer, the arm is too cramped, farther,
it is too short."""

_BASE_SAMPLES, _BASES_TRIED, _ARM_SEEDS = 300, 30, 2
_ARM_SEED_SPREAD = 0.7
"""Standard deviation of the seeds of inverse kinematics about the ready pose, rad."""

_GOAL_CONFIGURATIONS = 2
"""Goal configurations to which a path is planned; the shortest that works counts."""

_PATHS_EACH = 6
"""Paths planned to each: RRT-Connect finds now one way round an obstacle, now another."""


_PLANNED_CLEARANCE = 1.2 * MIN_CLEARANCE
_PLANNED_ARM_STEP = 0.05
"""Clearance (m) and distance between checks (rad) while planning for the arm: the checks of the
proof are denser."""


@dataclass(frozen=True)
class Proof:
    """A motion that solves a scene.

    Attributes:
        path_length: Length of the base's path, m.
        motion: Configurations on the way, dense, shape (N, 10).
    """

    path_length: float
    motion: FloatArray


class Prover:
    """Plans in one scene after another."""

    def __init__(self) -> None:
        self._robot = MobileManipulator.load()
        self._world = PyBulletWorld()
        self._tucked = tucked_sizes(self._robot)

    def prove(self, scene: Scene, seed: int, accepted: tuple[float, float]) -> Proof | None:
        """Look for a motion whose base path has an accepted length; seeded, never timed.

        Args:
            scene: The scene.
            seed: Of all random choices, > 0.
            accepted: Least and greatest length of the base's path, m.
        """
        rng = np.random.default_rng(seed)
        self._world.set_scene(scene)
        areas = forbidden_areas(scene, self._tucked)
        routes = []
        for goal in islice(self._goal_configurations(scene, areas, rng), _GOAL_CONFIGURATIONS):
            path = _base_path(scene, areas, goal[:2], seed)
            if path is not None:
                routes.append((path, goal))
            elif not routes:
                return None  # the bases are close together: the next would not be reached either
        for path, goal in sorted(routes, key=lambda route: length(route[0])):
            if accepted[0] <= length(path) <= accepted[1]:
                motion = self._motion(scene, path, goal, seed)
                if motion is not None and is_clear(self._world, motion):
                    return Proof(length(path), motion)
        return None

    def _goal_configurations(
        self, scene: Scene, areas: ForbiddenAreas, rng: np.random.Generator
    ) -> Iterator[FloatArray]:
        """Configurations (10,) at the goal, those of nearer bases first."""
        T_goal = _matrix(scene)
        start = np.array(scene.start.base[:2])
        around = _bases_around(T_goal, rng)
        free = around[[can_turn(areas, base[:2]) for base in around]]
        tried = free[:_BASES_TRIED]
        for base in tried[np.argsort(np.linalg.norm(tried[:, :2] - start, axis=1))]:
            for _ in range(_ARM_SEEDS):
                seed = ARM_READY + _ARM_SEED_SPREAD * rng.standard_normal(7)
                arm = arm_ik(self._robot, base, T_goal, np.clip(seed, ARM_LOWER, ARM_UPPER))
                if arm is None:
                    continue
                configuration = np.concatenate([base, arm])
                if clearance(self._world, configuration) >= GOAL_CLEARANCE:
                    yield configuration
                    break

    def _motion(
        self, scene: Scene, path: FloatArray, goal: FloatArray, seed: int
    ) -> FloatArray | None:
        start = np.array(scene.start.base)
        fold = self._arm_path(start, ARM_READY, TUCKED_ARM, seed)
        unfold = self._arm_path(goal[:3], TUCKED_ARM, goal[3:], seed)
        if fold is None or unfold is None:
            return None
        return whole_motion(start, fold, path, float(goal[2]), unfold)

    def _arm_path(
        self, base: FloatArray, start: FloatArray, end: FloatArray, seed: int
    ) -> FloatArray | None:
        """Joint path (N, 7) with the base at a pose (3,)."""

        def is_free(arm: FloatArray) -> bool:
            configuration = np.concatenate([base, arm])
            return clearance(self._world, configuration) >= _PLANNED_CLEARANCE

        def connects(a: FloatArray, b: FloatArray) -> bool:
            points = densify(np.array([a, b]), _PLANNED_ARM_STEP)
            # In random order a collision in the middle is found sooner.
            return all(is_free(p) for p in np.random.default_rng(0).permutation(points))

        space = Space(ARM_LOWER, ARM_UPPER, is_free, connects, budget=300, shortcuts=1)
        return rrt_connect(space, start, end, seed)


def _base_path(
    scene: Scene, areas: ForbiddenAreas, end: FloatArray, seed: int
) -> FloatArray | None:
    """Shortest of several base paths (N, 2) from the start to a position."""
    centers = np.array([box.center[:2] for box in scene.boxes])
    space = Space(
        lower=centers.min(axis=0),
        upper=centers.max(axis=0),
        is_free=partial(can_turn, areas),
        connects=partial(can_drive, areas),
        budget=20_000,
        shortcuts=8,
    )
    start = np.array(scene.start.base[:2])
    paths = []
    for k in range(_PATHS_EACH):
        path = rrt_connect(space, start, end, seed + k)
        if path is None:
            break
        paths.append(path)
    return min(paths, key=length, default=None)


def _matrix(scene: Scene) -> FloatArray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(scene.goal.quaternion_xyzw).as_matrix()
    T[:3, 3] = scene.goal.position
    return T


def _bases_around(T_goal: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Base poses (N, 3) in a ring about the goal that more or less look at it."""
    angle = rng.uniform(-np.pi, np.pi, _BASE_SAMPLES)
    radius = rng.uniform(*_REACH, _BASE_SAMPLES)
    heading = angle + np.pi + rng.uniform(-1.0, 1.0, _BASE_SAMPLES)
    x, y = T_goal[:2, 3]
    return np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle), heading])
