"""The Gymnasium environment: wiring only."""

from __future__ import annotations

import time
from typing import Any, SupportsFloat, cast

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle

from horf_env.control import (
    Command,
    ControlPreset,
    Sensed,
    action_layer,
    control_preset,
    deviation,
    servo_twist,
)
from horf_env.errors import InvalidActionError, UnknownNameError
from horf_env.faults import Fault
from horf_env.perception import (
    CELLS,
    CHANNELS,
    GUIDE_SIZE,
    CameraModel,
    Guide,
    MemorySettings,
    SeenSpace,
    top_view,
)
from horf_env.records import StepRecord
from horf_env.robot import (
    ARM_READY,
    LimitsProfile,
    MobileManipulator,
    RobotState,
    limits_profile,
)
from horf_env.robot.vectors import norm
from horf_env.scenes.scene import Scene
from horf_env.scenes.source import SceneSource, scene_source
from horf_env.sdf import RobotSdf
from horf_env.sensing import Senses
from horf_env.simulation import MoveResult, PyBulletWorld
from horf_env.task import MAX_STEPS, STEP, RewardTerms, RewardWeights, is_reached, reward_terms
from horf_env.types import FloatArray

_WORLD_EXTENT = 100.0  # m; bound of the position error in the observation space
_ARM_EXTENT = 2.0  # m; the end effector never is farther from the base
_JOINT_SLACK = 0.1  # rad or part of the speed: room for motors that overshoot a limit

Observation = dict[str, np.ndarray]


class HorfReachEnv(gym.Env[Observation, np.ndarray], EzPickle):
    """Bring the gripper of a mobile manipulator to a pose through clutter.

    The observation is a dict:

    - `depth`: last five depth images, oldest first, uint8, shape (5, H, W); 0 = nothing measured,
      1 to 255 = near to far.
    - `state`: arm joints [rad] (7), velocity of base and arm [m/s, rad/s] (9), position of the end
      effector in the frame of the base [m] (3).
    - `deviation`: position error [m] and rotation vector [rad] to the goal in base axes (6).
    - `map`, with `map_view` only: what the action layer knows of the surroundings, seen from above,
      uint8, shape (3, 32, 32), see `horf_env.perception.top_view`.
    - `guide`, if asked for: hints that follow from the goal and from what the action layer knows,
      shape (13,), see `horf_env.perception.Guide`.

    Action in [-1, 1]: EE twist in base axes, scaled to the limits profile's `twist_scale`; for
    `action_layer="joint_velocity"` the nine velocities, scaled to the limits. Numbers outside of
    the range are clipped.

    An episode ends on success or contact, and is truncated after 1000 steps of 0.05 s.

    Attributes:
        posture: Joints that the QP lets the arm go back to where the twist leaves it free, shape
            (7,), rad; the ready pose from every reset on. A planner may set another one.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012  Gymnasium's way

    def __init__(
        self,
        scene: str = "forest",
        *,
        action_layer: str = "sdf_qp",
        control: str | ControlPreset = "default",
        limits: str = "ld60",
        simulation: str = "kinematic",
        perception: str = "camera",
        memory: MemorySettings | None = None,
        camera: CameraModel | None = None,
        image: tuple[int, int] | None = None,
        depth_noise: bool = False,
        map_view: bool = False,
        guide: bool = False,
        reward: RewardWeights | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Make the environment.

        Args:
            scene: "aisle", "room", "forest", "doorway", "mixed" (all of them), or the path of a
                scene file.
            action_layer: What turns an action into a velocity: "sdf_qp", "sampled_qp" or
                "joint_velocity".
            control: Settings of the QP, or the preset "default", "paper" or "hra".
            limits: Limits profile: "ld60" or "paper".
            simulation: "kinematic" (exact, deterministic) or "dynamic" (velocity motors).
            perception: "camera", or "full": true surface points for the action layer.
            memory: How what the camera has shown is remembered: `MapSettings` or `FrameSettings`;
                that of the control preset without it.
            camera: Depth camera; 64 x 48 pixels on the front, pitched up, without it.
            image: Width and height of the depth images in observations, at most those of the
                camera; those of the camera without it. What the action layer knows comes from the
                camera's own images.
            depth_noise: Whether depth images have the D435's disparity noise.
            map_view: Whether observations have a `map`; the paper's have none.
            guide: Whether observations have a `guide`, see `Guide`; the paper's have none.
            reward: Weights of the reward; see there for those without it.
            render_mode: "rgb_array" or None.

        Raises:
            UnknownNameError: If any of the names is not valid.
            SceneFileError: If the scene file cannot be used.
            MissingAssetError: If the Panda's meshes are not installed.
            SettingError: If the images in observations have more pixels than the camera, or the
                memory is none.
        """
        EzPickle.__init__(
            self,
            scene,
            action_layer=action_layer,
            control=control,
            limits=limits,
            simulation=simulation,
            perception=perception,
            memory=memory,
            camera=camera,
            image=image,
            depth_noise=depth_noise,
            map_view=map_view,
            guide=guide,
            reward=reward,
            render_mode=render_mode,
        )
        self.render_mode = render_mode
        self.fault = Fault()
        self.limits: LimitsProfile = limits_profile(limits)
        preset = control_preset(control)
        self._scenes: SceneSource = scene_source(scene)
        self._robot = MobileManipulator.load()
        sdf = RobotSdf.load(self._robot)
        self._layer = _make_layer(action_layer, sdf, self.limits, preset, STEP)
        self._camera = camera or CameraModel()
        self._senses = Senses(
            sdf,
            self._camera,
            perception=perception,
            memory=memory or preset.memory,
            depth_noise=depth_noise,
            image=image,
        )
        self._world = PyBulletWorld(mode=simulation)
        self._map_view, self._guided = map_view, guide
        self._reward = reward or RewardWeights()
        size = image or (self._camera.width, self._camera.height)
        space = _observation_space(size, self.limits, map_view=map_view, guide=guide)
        self.observation_space = cast("spaces.Space[Observation]", space)
        self.action_space = spaces.Box(-1.0, 1.0, (self._layer.action_size,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: Seed of the environment's generator.
            options: {"instance": k} for instance k of the scene's frozen test set, or
                {"instance": k, "split": "validation"}; a random training instance without it.

        Raises:
            ValueError: If there is no such instance, or an option is unknown.
        """
        super().reset(seed=seed)
        for name in sorted(set(options or {}) - {"instance", "split"}):
            raise UnknownNameError("reset option", name, ["instance", "split"])
        self.scene: Scene = self._scenes.pick(self.np_random, **(options or {}))
        self.fault.reset(self.np_random)
        self._world.set_scene(self.scene)
        self.T_world_goal = self.scene.goal.pose
        self._start_episode(self._robot.state(self._world.state.configuration))
        self._guide: Guide | None = None
        frames = self._senses.reset(self.scene, self._state, self.np_random, self.fault.image)
        self._look_around()
        self.record = self._record(self._points, None, np.zeros(6), None)
        return self._observation(frames), self._info()

    def step(
        self, action: np.ndarray
    ) -> tuple[Observation, SupportsFloat, bool, bool, dict[str, Any]]:
        """Move for 0.05 s.

        Args:
            action: In [-1, 1], shape (6,) or (9,).

        Raises:
            InvalidActionError: If the action has another shape or is not finite; nothing moves.
        """
        action = self._checked(action)
        servo = servo_twist(self._deviation, self.limits.twist_scale)
        points = self._points
        begin = time.perf_counter()
        command = self._layer.command(
            action,
            Sensed(
                state=self._state,
                velocity=self._commanded,
                points=points,
                unseen=self._unseen,
                position_error=norm(self._deviation[:3]),
                posture=self.posture,
            ),
        )
        self._layer_time = time.perf_counter() - begin
        moved = self._world.move(self.fault.velocity(command.velocity), STEP)
        achieved = self._state.ee_jacobian @ moved.velocity
        self._advance(moved, command.velocity)
        now = self._steps * STEP
        frames = self._senses.update(self._state, self.np_random, now, self.fault.image)
        self._look_around()
        reward = reward_terms(
            self._deviation,
            twist=command.twist,
            servo_twist=servo,
            clearance=self._min_distance,
            collided=self._collided,
            weights=self._reward,
        )
        self.record = self._record(points, command, achieved, reward)
        success = is_reached(self._deviation) and not self._collided
        terminated = success or self._collided
        truncated = not terminated and self._steps >= MAX_STEPS
        info = self._info()
        if terminated or truncated:
            info |= self._episode_info(success)
        return self._observation(frames), reward.total, terminated, truncated, info

    @property
    def camera(self) -> CameraModel:
        """The depth camera."""
        return self._camera

    @property
    def space(self) -> SeenSpace:
        """What the senses have shown so far."""
        return self._senses

    @property
    def guide(self) -> Guide:
        """The guide of this episode, for observations and planners alike."""
        if self._guide is None:
            start = self._state.T_world_base[:2, 3]
            self._guide, self._hinted = Guide(self.T_world_goal, start, self._senses), -1
        return self._guide

    @property
    def hints(self) -> FloatArray:
        """What the guide says now, shape (13,); it looks once in a step."""
        guide = self.guide
        if self._hinted != self._steps:
            self._hinted, self._hints = self._steps, guide.view(self._state.T_world_base)
        return self._hints

    @property
    def contact(self) -> tuple[str, str] | None:
        """Link and obstacle ("boxes[3]", "floor", a link of the base) that touch, or None."""
        return self._contact

    def render(self) -> np.ndarray | None:
        """Picture of robot and scene, uint8, shape (480, 640, 3); None without a render mode."""
        return self._world.render_rgb() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Free the physics server."""
        self._world.close()

    def _checked(self, action: np.ndarray) -> FloatArray:
        array = np.asarray(action, dtype=float)
        if array.shape != self.action_space.shape:
            raise InvalidActionError(
                f"action: expected shape {self.action_space.shape}, got {array.shape}"
            )
        if not np.isfinite(array).all():
            raise InvalidActionError(f"action: expected finite numbers, got {array}")
        return np.minimum(np.maximum(array, -1.0), 1.0)

    def _start_episode(self, state: RobotState) -> None:
        self._state, self._velocity = state, np.zeros(9)
        # The drives ramp from command to command: braking must not wait for those that lag behind.
        self._commanded = np.zeros(9)
        self.posture: FloatArray = ARM_READY
        self._deviation = self._goal_deviation(state)
        self._min_distance = self._world.clearance.distance
        self._contact: tuple[str, str] | None = None
        self._steps, self._path_base, self._path_ee, self._layer_time = 0, 0.0, 0.0, 0.0

    def _advance(self, moved: MoveResult, commanded: FloatArray) -> None:
        before = self._state
        self._state = self._robot.state(moved.configuration, overshoot=True)
        self._velocity, self._commanded = moved.velocity, commanded
        self._deviation = self._goal_deviation(self._state)
        self._min_distance = moved.clearance.distance
        self._contact = moved.contact
        self._steps += 1
        self._path_base += _distance(before.T_world_base, self._state.T_world_base)
        self._path_ee += _distance(before.T_world_ee, self._state.T_world_ee)

    def _look_around(self) -> None:
        """Ask the memory what is around: for the next command, and for the policy's map."""
        self._points = self._senses.points(self._state)
        self._unseen = self._senses.unseen_ground(self._state)

    @property
    def _collided(self) -> bool:
        return self._contact is not None

    def _goal_deviation(self, state: RobotState) -> FloatArray:
        R_base = state.T_world_base[:3, :3]
        return np.asarray(deviation(state.T_world_ee, self.T_world_goal, R_base))

    def _observation(self, frames: np.ndarray) -> Observation:
        R, t = self._state.T_world_base[:3, :3], self._state.T_world_base[:3, 3]
        ee_in_base = R.T @ (self._state.T_world_ee[:3, 3] - t)
        state = np.concatenate([self._state.configuration[3:], self._velocity, ee_in_base])
        observation = {
            "depth": frames,
            "state": state.astype(np.float32),
            "deviation": self._deviation.astype(np.float32),
        }
        if self._map_view:
            observation["map"] = top_view(self._points, self._unseen, self._state.T_world_base)
        if self._guided:
            observation["guide"] = self.hints.astype(np.float32)
        return observation

    def _record(
        self,
        points: FloatArray,
        command: Command | None,
        achieved: FloatArray,
        reward: RewardTerms | None,
    ) -> StepRecord:
        return StepRecord(
            time=self._steps * STEP,
            state=self._state,
            depth=self._senses.depth,
            points=points,
            command=command,
            twist_achieved=achieved,
            reward=reward,
            min_distance=self._min_distance,
            layer_time=self._layer_time,
        )

    def _info(self) -> dict[str, Any]:
        command = self.record.command
        qp = command.qp if command else None
        return {
            "is_success": is_reached(self._deviation) and not self._collided,
            "is_collision": self._collided,
            "min_distance": self._min_distance,
            "twist_command": command.twist.copy() if command else np.zeros(6),
            "twist_achieved": self.record.twist_achieved.copy(),
            "velocity": self._velocity.copy(),
            "qp_status": qp.status if qp else "none",
            "qp_slack": qp.row_slack if qp else 0.0,
        }

    def _episode_info(self, success: bool) -> dict[str, Any]:
        failure = "" if success else "collision" if self._collided else "timeout"
        return {
            "failure": failure,
            "path_length_base": self._path_base,
            "path_length_ee": self._path_ee,
            "execution_time": self._steps * STEP,
        }


# The constructor's argument of the same name hides the function.
_make_layer = action_layer


def _observation_space(
    image: tuple[int, int], limits: LimitsProfile, *, map_view: bool, guide: bool
) -> spaces.Dict:
    lower = np.concatenate([limits.arm_lower - _JOINT_SLACK, -limits.velocity, [-_ARM_EXTENT] * 3])
    upper = np.concatenate([limits.arm_upper + _JOINT_SLACK, limits.velocity, [_ARM_EXTENT] * 3])
    lower[7:16] *= 1.0 + _JOINT_SLACK
    upper[7:16] *= 1.0 + _JOINT_SLACK
    reach = np.array([_WORLD_EXTENT] * 3 + [np.pi + 1e-6] * 3, dtype=np.float32)
    parts: dict[str, spaces.Space[Any]] = {
        "depth": spaces.Box(0, 255, (5, image[1], image[0]), np.uint8),
        "state": spaces.Box(lower.astype(np.float32), upper.astype(np.float32)),
        "deviation": spaces.Box(-reach, reach),
    }
    if map_view:
        parts["map"] = spaces.Box(0, 255, (CHANNELS, CELLS, CELLS), np.uint8)
    if guide:
        parts["guide"] = spaces.Box(-_WORLD_EXTENT, _WORLD_EXTENT, (GUIDE_SIZE,), np.float32)
    return spaces.Dict(parts)


def _distance(T_a: FloatArray, T_b: FloatArray) -> float:
    return norm(T_b[:3, 3] - T_a[:3, 3])
