"""The packaged policy is what its manifest says."""

import hashlib
import json

import numpy as np
from horf_cli.environments import EnvSettings, make_env
from horf_cli.methods import Method, make_planner, parse_methods
from horf_cli.packaged import POLICY
from horf_cli.policy_files import read_policy

MANIFEST = json.loads(POLICY.with_suffix(".json").read_text())


def test_the_manifest_tells_where_the_weights_come_from():
    settings, _ = read_policy(POLICY)
    assert MANIFEST["sha256"] == hashlib.sha256(POLICY.read_bytes()).hexdigest()
    assert MANIFEST["step"] == settings.step <= MANIFEST["config"]["steps"]
    assert settings.algo == MANIFEST["config"]["algo"]
    assert EnvSettings.model_validate_json(json.dumps(MANIFEST["config"]["env"])) == settings.env
    assert set(MANIFEST["test"]["scenes"]) == {"aisle", "room", "forest", "doorway"}
    assert POLICY.stat().st_size < 5e6


def test_it_sees_no_more_than_a_robot_can():
    settings, _ = read_policy(POLICY)
    assert settings.env.perception == "camera"
    assert settings.env.limits == "ld60"


def test_is_the_method_horf():
    (method,) = parse_methods(["horf"], [])
    assert method == Method("horf", str(POLICY))
    planner = make_planner(method)
    env = make_env(EnvSettings(scene="room").for_planner(planner))
    observation, _ = env.reset(seed=0)
    planner.reset(env)
    action = planner.act(observation)
    assert action.shape == (6,)
    assert (np.abs(action) <= 1.0).all()
    env.close()
