"""What the last image shows beyond the local map."""

import numpy as np
import pytest

from horf_env.perception import CameraModel, DepthCamera, FarView, unproject
from horf_env.robot import ARM_READY
from horf_env.scenes import Box, Goal, Scene, Start, triangles

MODEL = CameraModel()
START = Start((0.0, 0.0, 0.0), tuple(ARM_READY.tolist()))
GOAL = Goal((1.0, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0))
PLACE = np.zeros(2)
# On the axis of the base: before a box 3.5 m ahead, in it, and beside it.
BEFORE, WITHIN, BESIDE = [3.2, 0.0, 0.3], [4.0, 0.0, 0.3], [4.0, 1.5, 0.3]


def view(*boxes, change=lambda depth: depth):
    camera, T = DepthCamera(MODEL), MODEL.T_base_camera
    camera.set_scene(*triangles(Scene("test", boxes, (), (), START, GOAL), floor=True))
    depth, shown = change(camera.render(T)), FarView(MODEL)
    shown.take_in(depth, unproject(depth, MODEL, T), T)
    return shown


def box(x):
    return Box((x, 0.0, 0.5), (0.25, 0.5, 0.5), 0.0)


def test_shows_surfaces_between_the_local_map_and_the_end_of_the_cameras_range():
    near, far, too_far = (view(box(x)).surfaces(PLACE) for x in (2.0, 3.75, 6.0))
    assert len(near) == len(too_far) == 0
    assert len(far) > 20
    np.testing.assert_allclose(far[:, 0], 3.5, atol=0.01)


def test_the_floor_is_no_surface():
    assert len(view().surfaces(PLACE)) == 0


@pytest.mark.parametrize(
    ("boxes", "expected"), [((), [True, True, True]), ((box(3.75),), [True, False, True])]
)
def test_has_seen_what_nothing_stands_before(boxes, expected):
    assert view(*boxes).seen(np.array([BEFORE, WITHIN, BESIDE])).tolist() == expected


def test_has_not_seen_what_is_out_of_view_or_out_of_range():
    behind, to_the_side, too_far = [-1.0, 0.0, 0.3], [1.0, 3.0, 0.3], [5.6, 0.0, 0.3]
    assert not view().seen(np.array([behind, to_the_side, too_far])).any()


def test_without_a_measurement_the_view_is_free_up_to_the_cameras_range():
    blind = view(change=np.zeros_like)
    assert blind.seen(np.array([WITHIN, [5.6, 0.0, 0.3]])).tolist() == [True, False]
    assert len(blind.surfaces(PLACE)) == 0


def test_shows_nothing_before_the_first_image():
    assert len(FarView(MODEL).surfaces(PLACE)) == 0
