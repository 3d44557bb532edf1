"""Episodes: reaching, colliding, timing out, and bad input."""

import gymnasium as gym
import numpy as np
import pytest

from horf_env.env import HorfReachEnv
from horf_env.errors import InvalidActionError, SceneFileError, SettingError, UnknownNameError
from horf_env.planners import PLANNERS
from horf_env.task import GOAL_REWARD, MAX_STEPS, RewardWeights, is_reached, reward_terms

ALL_INFO = {
    "is_success",
    "is_collision",
    "min_distance",
    "twist_command",
    "twist_achieved",
    "velocity",
    "qp_status",
    "qp_slack",
}
END_INFO = {"failure", "path_length_base", "path_length_ee", "execution_time"}


def run_hra(env, steps=400):
    planner = PLANNERS["hra"]()
    observation, _ = env.reset(seed=0)
    planner.reset(env)
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(planner.act(observation))
        if terminated or truncated:
            break
    return reward, terminated, truncated, info


@pytest.mark.parametrize("simulation", ["kinematic", "dynamic"])
def test_the_servo_reaches_a_free_goal(scene_file, simulation):
    env = HorfReachEnv(scene_file(), simulation=simulation)
    reward, terminated, truncated, info = run_hra(env)
    assert terminated
    assert not truncated
    assert info["is_success"]
    assert info["failure"] == ""
    assert reward > GOAL_REWARD - 1.0
    assert set(info) == ALL_INFO | END_INFO
    assert 0.3 < info["path_length_base"] < 3.0
    assert 0.9 < info["path_length_ee"] < 3.0
    assert info["execution_time"] == pytest.approx(0.05 * env.record.time / 0.05)


@pytest.mark.parametrize("perception", ["camera", "full"])
def test_the_qp_stops_in_front_of_a_wall(scene_file, perception):
    wall = ([1.4, 0.0, 0.75], [0.05, 2.0, 0.75], 0.0)
    env = HorfReachEnv(scene_file([wall], goal=(3.0, 0.0, 0.6)), perception=perception)
    _, terminated, _, info = run_hra(env, steps=150)
    assert not terminated
    assert not info["is_collision"]
    assert info["min_distance"] > 0.0
    assert np.abs(info["velocity"]).max() < 0.2


def test_joint_velocities_are_not_held_back_and_the_contact_ends_the_episode(scene_file):
    wall = ([1.2, 0.0, 0.75], [0.05, 2.0, 0.75], 0.0)
    env = HorfReachEnv(scene_file([wall]), action_layer="joint_velocity")
    env.reset(seed=0)
    forward = np.array([1.0, *np.zeros(8)])
    for _ in range(60):
        _, reward, terminated, _, info = env.step(forward)
        if terminated:
            break
    assert info["is_collision"]
    assert info["failure"] == "collision"
    assert not info["is_success"]
    assert reward < -20


def test_an_episode_is_truncated_after_a_thousand_steps(scene_file):
    env = HorfReachEnv(scene_file(goal=(3.0, 0.0, 0.6)))
    env.reset(seed=0)
    for step in range(1, MAX_STEPS + 1):
        _, _, terminated, truncated, info = env.step(np.zeros(6))
        assert truncated == (step == MAX_STEPS)
        assert not terminated
    assert info["failure"] == "timeout"
    assert info["execution_time"] == pytest.approx(50.0)


def test_frozen_instances_are_the_same_for_any_seed():
    env = HorfReachEnv("forest")
    a, _ = env.reset(seed=1, options={"instance": 7})
    b, _ = env.reset(seed=2, options={"instance": 7})
    np.testing.assert_array_equal(a["depth"], b["depth"])
    c, _ = env.reset(seed=1, options={"instance": 7, "split": "validation"})
    assert (a["deviation"] != c["deviation"]).any()


def test_info_of_different_steps_shares_no_memory(scene_file):
    env = HorfReachEnv(scene_file())
    env.reset(seed=0)
    first = env.step(np.ones(6))[-1]
    kept = first["velocity"].copy()
    env.step(-np.ones(6))
    np.testing.assert_array_equal(first["velocity"], kept)


@pytest.mark.parametrize("action", [np.zeros(9), np.zeros((1, 6)), np.full(6, np.nan), np.inf])
def test_a_bad_action_is_refused_before_anything_moves(scene_file, action):
    env = HorfReachEnv(scene_file())
    env.reset(seed=0)
    before = env.record.state.configuration
    with pytest.raises(InvalidActionError, match="action: expected"):
        env.step(action)
    observation, *_ = env.step(np.zeros(6))
    assert env.record.time == pytest.approx(0.05)
    np.testing.assert_allclose(env.record.state.configuration, before, atol=0.02)
    assert np.isfinite(observation["state"]).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scene": "forrest"}, "unknown scene 'forrest'; did you mean 'forest'"),
        ({"action_layer": "sdf"}, "did you mean 'sdf_qp'"),
        ({"limits": "ld6"}, "did you mean 'ld60'"),
        ({"control": "defualt"}, "did you mean 'default'"),
        ({"simulation": "kinematics"}, "did you mean 'kinematic'"),
        ({"perception": "cam"}, "did you mean 'camera'"),
    ],
)
def test_unknown_names_are_refused_with_the_nearest(options, message):
    with pytest.raises(UnknownNameError, match=message):
        gym.make("horf/Reach-v0", **options)


@pytest.mark.parametrize("option", ["instanc", "seed"])
def test_an_unknown_reset_option_is_refused(scene_file, option):
    with pytest.raises(UnknownNameError, match=f"unknown reset option '{option}'.*Valid: instance"):
        HorfReachEnv(scene_file()).reset(options={option: 3})


def test_info_tells_the_twist_that_was_asked_for_and_the_one_achieved(scene_file):
    env = HorfReachEnv(scene_file())
    env.reset(seed=0)
    action = np.array([0.1, -0.1, 0.05, 0.0, 0.1, 0.2])
    for _ in range(5):
        J = env.record.state.ee_jacobian
        info = env.step(action)[-1]
        np.testing.assert_allclose(info["twist_command"], action * env.limits.twist_scale)
        np.testing.assert_allclose(info["twist_achieved"], J @ info["velocity"])


def test_a_memory_that_is_none_is_named():
    with pytest.raises(SettingError, match="'memory': expected MapSettings or FrameSettings"):
        HorfReachEnv("room", memory="map")


def test_a_malformed_scene_file_is_named(scene_file):
    path = scene_file(goal=[0.0, 0.0])
    with pytest.raises(SceneFileError, match=r"goal\.position") as error:
        HorfReachEnv(path)
    assert path in str(error.value)


def test_the_collision_term_is_continuous_and_bounded():
    def collision(clearance, collided=False):
        return reward_terms(
            np.ones(6),
            twist=np.zeros(6),
            servo_twist=np.zeros(6),
            clearance=clearance,
            collided=collided,
            weights=RewardWeights(),
        ).collision

    assert collision(0.05) == collision(0.3) == 0.0
    assert collision(0.05 - 1e-9) == pytest.approx(0.0, abs=1e-6)
    assert collision(0.025) == pytest.approx(np.log(0.5))
    assert collision(0.0) == pytest.approx(np.log(0.02))
    assert collision(-0.01, collided=True) == -25.0


def test_success_needs_position_and_orientation():
    assert is_reached(np.array([0.029, 0, 0, 0, 0.09, 0]))
    assert not is_reached(np.array([0.031, 0, 0, 0, 0, 0]))
    assert not is_reached(np.array([0, 0, 0, 0.08, 0.08, 0]))


def test_reward_is_the_sum_of_its_terms(scene_file):
    env = HorfReachEnv(scene_file())
    observation, _ = env.reset(seed=0)
    planner = PLANNERS["hra"]()
    planner.reset(env)
    _, reward, *_ = env.step(planner.act(observation))
    terms = env.record.reward
    assert terms.follow == pytest.approx(0.0, abs=1e-6)
    assert terms.time == -0.05
    assert reward == pytest.approx(terms.deviation + terms.time + terms.follow + terms.collision)


def test_one_guide_for_observations_and_planners():
    env = gym.make("horf/Reach-v0", scene="room", guide=True, disable_env_checker=True)
    observation, _ = env.reset(seed=0)
    planner = PLANNERS["mapped"]()
    planner.reset(env)
    own = env.unwrapped.guide
    for _ in range(3):
        observation, *_ = env.step(planner.act(observation))
        np.testing.assert_array_equal(observation["guide"], env.unwrapped.hints.astype(np.float32))
    assert env.unwrapped.guide is own
    env.reset(seed=0)
    assert env.unwrapped.guide is not own
    env.close()
