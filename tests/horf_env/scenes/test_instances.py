from __future__ import annotations

import json
from itertools import combinations

import numpy as np
import pytest

from horf_env.errors import HorfEnvError, SceneFileError, UnknownNameError
from horf_env.scenes import instances as packaged
from horf_env.scenes.families import SCENES
from horf_env.scenes.instances import (
    SPLITS,
    InstanceFile,
    parse_instances,
    scene_hash,
)
from horf_env.scenes.laws import goal_has_room, start_is_clear
from horf_env.scenes.source import family_instance, scene_source

all_families = pytest.mark.parametrize("name", SCENES)


@all_families
def test_splits_are_complete_and_in_order(name):
    file = packaged.instances(name)
    for split, (first_seed, size) in SPLITS.items():
        seeds = [instance.seed for instance in getattr(file, split)]
        assert len(seeds) == size
        assert seeds == sorted(set(seeds))
        assert seeds[0] >= first_seed


@all_families
def test_seed_ranges_are_disjoint(name):
    file = packaged.instances(name)
    ranges = [
        (seeds[0], seeds[-1])
        for split in SPLITS
        if (seeds := [instance.seed for instance in getattr(file, split)])
    ]
    assert all(a[1] < b[0] or b[1] < a[0] for a, b in combinations(ranges, 2))


@all_families
def test_test_instances_are_those_that_were_proven(name):
    for k in range(50):
        scene = packaged.test_instance(name, k)  # raises if the hash is wrong
        assert scene.name == name
        assert start_is_clear(scene)
        assert goal_has_room(scene)


@all_families
def test_frozen_instances_are_what_the_family_still_draws(name):
    for instance in packaged.instances(name).test[:5]:
        assert packaged.random_scene(name, instance.seed) == instance.scene


@all_families
def test_path_lengths_are_near_the_papers(name):
    target = SCENES[name].base_path
    lengths = np.array([packaged.planner_path_length(name, k) for k in range(50)])
    assert np.all((lengths >= 0.8 * target) & (lengths <= 1.2 * target))
    for k in range(50):
        scene = packaged.test_instance(name, k)
        straight = np.subtract(scene.goal.position[:2], scene.start.base[:2])
        # The base stops where the arm (at most 0.95 m from its axis) reaches the goal.
        assert lengths[k] >= np.linalg.norm(straight) - 0.95


@all_families
def test_validation_instances_are_drawn_again_from_their_seeds(name):
    scenes = [packaged.validation_instance(name, k) for k in range(3)]
    assert len({scene_hash(scene) for scene in scenes}) == 3
    assert packaged.validation_instance(name, 1) == scenes[1]


@all_families
def test_training_instances_depend_on_the_generator_alone(name):
    def draw(seed: int) -> list[str]:
        rng = np.random.default_rng(seed)
        return [packaged.training_instance(name, rng).to_json() for _ in range(3)]

    assert draw(0) == draw(0)
    assert draw(0) != draw(1)


def test_no_scene_is_in_two_splits():
    for name in SCENES:
        file = packaged.instances(name)
        hashes = [i.sha256 for split in SPLITS for i in getattr(file, split)]
        assert len(hashes) == len(set(hashes))


def test_unknown_scene_names_the_nearest():
    with pytest.raises(UnknownNameError, match="'forest'"):
        packaged.test_instance("forst", 0)
    with pytest.raises(UnknownNameError):
        packaged.training_instance("kitchen", np.random.default_rng(0))


@pytest.mark.parametrize("k", [-1, 50])
def test_number_outside_the_split(k):
    with pytest.raises(packaged.InstanceIndexError, match="0 to 49") as caught:
        packaged.test_instance("room", k)
    assert isinstance(caught.value, HorfEnvError)
    assert isinstance(caught.value, IndexError)


def _damaged(name: str, split: str) -> InstanceFile:
    """The packaged file with one changed scene, or one changed hash."""
    file = packaged.instances(name)
    first = json.loads(packaged.test_instance(name, 0).to_json())
    first["boxes"][4]["center"][0] += 1e-6
    instance = getattr(file, split)[0]
    record = {"seed": instance.seed, "path_length": 6.0, "sha256": instance.sha256}
    if split == "test":
        record["scene"] = first
    else:
        record["seed"] += 1
    return parse_instances(json.dumps({split: [record]}), source="damaged.json")


@pytest.mark.parametrize("split", ["test", "validation"])
def test_a_changed_scene_is_noticed(monkeypatch, split):
    damaged = _damaged("room", split)
    monkeypatch.setattr(packaged, "instances", lambda name: damaged)
    with pytest.raises(packaged.StaleInstanceError, match=r"room.*make_instances") as caught:
        getattr(packaged, f"{split}_instance")("room", 0)
    assert caught.value.seed == damaged.__dict__[split][0].seed


def test_malformed_file_names_file_and_field():
    text = json.dumps({"test": [{"seed": 0, "path_length": "long", "sha256": ""}]})
    with pytest.raises(SceneFileError, match=r"some\.json") as caught:
        parse_instances(text, source="some.json")
    assert caught.value.field == "test[0].path_length"


def test_mixed_scenes_take_turns():
    source, rng = scene_source("mixed"), np.random.default_rng(0)
    names = list(SCENES)
    for split, fixed in (
        ("test", packaged.test_instance),
        ("validation", packaged.validation_instance),
    ):
        for k in (0, 3, 6, 17):
            expected = fixed(names[k % 4], k // 4)
            assert source.pick(rng, instance=k, split=split) == expected
            assert family_instance("mixed", k) == (names[k % 4], k // 4)
    assert {source.pick(rng).name for _ in range(40)} == set(names)


def test_only_families_have_instances():
    assert family_instance("room", 5) == ("room", 5)
    assert family_instance("some/scene.json", 5) is None
