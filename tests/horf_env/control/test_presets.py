"""Presets: what each switches on, and settings that are refused."""

from dataclasses import replace

import numpy as np
import pytest

from horf_env.control import PRESETS, ControlPreset
from horf_env.control.haviland import HavilandObjective
from horf_env.control.objective import ScaledObjective
from horf_env.control.posture import PostureObjective
from horf_env.errors import SettingError
from horf_env.perception import FrameSettings, MapSettings
from horf_env.robot import ARM_READY, LIMITS

START = np.concatenate([np.zeros(3), ARM_READY])
NO_POINTS = np.zeros((0, 3))


def labels(preset):
    return {
        name.split(" panda")[0].split(" base_link")[0] for name in preset.whole_body_qp()._names
    }


def test_the_papers_preset_has_none_of_our_rules():
    paper = PRESETS["paper"]
    assert labels(paper) == {"obstacle", "floor"}
    assert paper.witnesses == 1
    assert paper.memory == FrameSettings(frames=5)
    assert isinstance(paper.objective, ScaledObjective)


def test_the_default_has_all_of_them_and_each_is_switched_alone():
    default = PRESETS["default"]
    every = labels(default)
    assert {"obstacle", "floor", "own base"} < every
    assert default.memory == MapSettings()
    for switch in ("avoid_own_base", "guard_unseen", "guard_reach"):
        assert labels(replace(default, **{switch: False})) < every


def test_havilands_weights(make_tick):
    terms = PRESETS["hra"].objective.terms(
        make_tick(START, NO_POINTS, np.zeros(6), position_error=2.0)
    )
    np.testing.assert_allclose(terms.weights, [0.005, 0.005, *[0.01] * 7])
    assert terms.slack_weight == pytest.approx(0.5)


def test_joint_dampers_are_those_of_the_settings(make_tick):
    q = START.copy()
    q[3] = LIMITS["ld60"].arm_upper[0] - 0.3
    tick = make_tick(q, NO_POINTS, np.zeros(6))
    preset = replace(PRESETS["default"], damper_gain=0.2, damper_influence=0.6, damper_stopping=0.1)
    problem = preset.whole_body_qp().problem(tick)
    assert problem.ub[2] == pytest.approx(0.2 * (0.3 - 0.1) / (0.6 - 0.1))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("witnesses", 0),
        ("witnesses", 1.5),
        ("own_base_witnesses", -1),
        ("margin", np.nan),
        ("margin", -0.1),
        ("influence", np.nan),
        ("gain", np.inf),
        ("gain", "2"),
        ("spacing", -1.0),
        ("unseen_margin", np.nan),
        ("damper_influence", 0.1),
        ("damper_stopping", np.nan),
    ],
)
def test_settings_that_would_switch_avoidance_off_are_refused(name, value):
    with pytest.raises(SettingError, match=f"setting '{name}': expected .*, got"):
        ControlPreset(**{name: value})


@pytest.mark.parametrize("kind", [ScaledObjective, PostureObjective])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_weights_without_a_minimum_are_refused(kind, value):
    for name in ("base_weight", "arm_weight", "slack_weight"):
        with pytest.raises(SettingError, match=f"setting '{name}': expected a finite number above"):
            kind(**{name: value})


def test_weights_of_haviland_are_checked_too():
    with pytest.raises(SettingError, match="joint_weight"):
        HavilandObjective(joint_weight=0.0)
