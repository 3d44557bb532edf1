"""The planner that knows the robot's own map only."""

import gymnasium as gym
import numpy as np

import horf_env  # noqa: F401  registers the environment
from horf_env.planners import PLANNERS, MappedPlanner
from horf_env.planners.carrying import ARM_TUCKED
from horf_env.robot import ARM_READY


def test_reaches_a_goal_with_what_the_camera_has_shown():
    env = gym.make("horf/Reach-v0", scene="doorway", perception="camera")
    planner = MappedPlanner()
    observation, info = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    done = False
    while not done:
        observation, _, terminated, truncated, info = env.step(planner.act(observation))
        done = terminated or truncated
    env.close()
    assert info["is_success"]
    assert not info["is_collision"]


def test_does_not_look_at_the_true_scene():
    env = gym.make("horf/Reach-v0", scene="forest", perception="camera")
    actions = []
    for hidden in (False, True):
        planner = MappedPlanner()
        observation, _ = env.reset(seed=0, options={"instance": 0, "split": "validation"})
        if hidden:
            env.unwrapped.scene = None
        planner.reset(env)
        actions.append(planner.act(observation))
    env.close()
    np.testing.assert_array_equal(*actions)


def test_turns_on_the_spot_or_on_a_wide_bend_where_there_is_room():
    """The inner side of a tight turn sweeps ground that the camera does not see."""
    env = gym.make("horf/Reach-v0", scene="aisle", perception="camera")
    planner = MappedPlanner()
    observation, _ = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    velocities = []
    for _ in range(300):
        T, points = env.unwrapped.record.state.T_world_base, env.unwrapped.record.points
        room = np.linalg.norm(points[points[:, 2] < 1.15, :2] - T[:2, 3], axis=1).min(initial=9.0)
        observation, *_, info = env.step(planner.act(observation))
        velocities.append([*info["velocity"][:2], room])
    env.close()
    forward, turn, room = np.abs(np.array(velocities)).T
    driving = (forward > 0.3) & (room > 0.85)
    assert driving.sum() > 50
    # The QP, which the planner tells how the gripper shall move, has a word in it.
    assert np.quantile(turn[driving] / forward[driving], 0.9) < 1.0


def test_carries_the_arm_tucked_and_reaches_from_the_ready_pose(monkeypatch):
    """As it turns to the goal in between it has the map presume more."""
    env = gym.make("horf/Reach-v0", scene="aisle", perception="camera")
    planner = MappedPlanner()
    observation, info = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    np.testing.assert_array_equal(env.unwrapped.posture, ARM_READY)
    told: list[float] = []
    monkeypatch.setattr(env.unwrapped.space, "presume", told.append)
    postures, done = [], False
    while not done:
        observation, _, terminated, truncated, info = env.step(planner.act(observation))
        postures.append(env.unwrapped.posture)
        done = terminated or truncated
    assert info["is_success"]
    np.testing.assert_array_equal(postures[0], ARM_TUCKED)
    np.testing.assert_array_equal(postures[-1], ARM_READY)
    assert told[0] == told[-1] == 0.0
    assert 0.3 in told
    env.reset(seed=0)
    np.testing.assert_array_equal(env.unwrapped.posture, ARM_READY)
    env.close()


def test_who_only_advises_leaves_the_arm_alone():
    env = gym.make("horf/Reach-v0", scene="aisle", perception="camera")
    planner = MappedPlanner()
    env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    planner.advise()
    np.testing.assert_array_equal(env.unwrapped.posture, ARM_READY)
    env.close()


def test_has_the_map_presume_nothing_behind_surfaces_while_it_drives(monkeypatch):
    """One that only advises leaves the map as it is."""
    env = gym.make("horf/Reach-v0", scene="room", perception="camera")
    planner, told = MappedPlanner(), []
    observation, _ = env.reset(seed=0, options={"instance": 0, "split": "validation"})
    planner.reset(env)
    monkeypatch.setattr(env.unwrapped.space, "presume", told.append)
    planner.advise()
    assert told == []
    planner.act(observation)
    env.close()
    assert told == [0.0]


def test_is_a_planner_by_name():
    assert PLANNERS["mapped"] is MappedPlanner
