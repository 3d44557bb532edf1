import numpy as np
import pytest
import trimesh

from horf_env.perception import CameraModel, DepthCamera
from horf_env.perception.image_bounds import pixel_windows
from horf_env.perception.ray_casting import RayCaster
from horf_env.robot import ARM_READY, collision_parts
from horf_env.robot.limits import ARM_LOWER, ARM_UPPER

MODEL = CameraModel()
LEVEL = CameraModel(pitch_up=0.0, position=(0.0, 0.0, 0.5))


def mesh_of(*parts):
    mesh = trimesh.util.concatenate(parts)
    return np.array(mesh.vertices), np.array(mesh.faces)


def box(center, half_extents, yaw=0.0):
    pose = trimesh.transformations.rotation_matrix(yaw, [0, 0, 1])
    pose[:3, 3] = center
    return trimesh.creation.box(2 * np.array(half_extents), pose)


def looking_at(model, *parts):
    camera = DepthCamera(model)
    camera.set_scene(*mesh_of(*parts))
    return camera.render(model.T_base_camera)


def slab_depth(model, T, center, half_extents, yaw):
    """Depth of a box by the slab method: an independent answer."""
    c, s = np.cos(yaw), np.sin(yaw)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    origin = R.T @ (T[:3, 3] - center)
    direction = model.rays @ T[:3, :3].T @ R
    with np.errstate(divide="ignore"):
        bounds = np.stack(
            [(sign * np.array(half_extents) - origin) / direction for sign in (-1, 1)]
        )
    enter, leave = bounds.min(axis=0).max(axis=-1), bounds.max(axis=0).min(axis=-1)
    return np.where((enter <= leave) & (enter > 0), enter, np.inf)


ARM = [  # the base is left out: it holds the camera
    mesh_of(*(trimesh.Trimesh(part.vertices, part.faces) for part in parts))
    for parts in collision_parts()[1:]
]


def test_wall_across_the_view_has_one_depth_at_all_pixels():
    depth = looking_at(LEVEL, box([2.1, 0, 0], [0.1, 20, 20]))
    assert depth.dtype == np.float32
    assert depth.shape == (48, 64)
    np.testing.assert_allclose(depth, 2.0, atol=1e-4)  # along the axis: ray lengths go up to 3.1 m


def test_floor_depth_is_the_height_over_the_downward_slope():
    depth = looking_at(MODEL, box([0, 0, -0.5], [100, 100, 0.5]))
    slope = -(MODEL.rays @ MODEL.T_base_camera[:3, :3].T)[..., 2]
    with np.errstate(divide="ignore"):
        expected = MODEL.position[2] / slope
    seen = (expected > 0) & (expected < MODEL.far)
    assert 0.1 < seen.mean() < 0.8
    np.testing.assert_allclose(depth[seen], expected[seen], atol=1e-4)
    assert not depth[~seen].any()


def test_random_boxes_agree_with_the_slab_method():
    rng = np.random.default_rng(3)
    boxes = [
        (rng.uniform([1, -2, 0], [5, 2, 2]), rng.uniform(0.05, 0.4, 3), rng.uniform(0, 3))
        for _ in range(25)
    ]
    depth = looking_at(MODEL, *(box(*b) for b in boxes))
    expected = np.min([slab_depth(MODEL, MODEL.T_base_camera, *b) for b in boxes], axis=0)
    expected = MODEL.within_range(expected)
    wrong = np.abs(depth - expected) > 1e-4
    assert (expected > 0).mean() > 0.3
    assert wrong.sum() <= 2  # a ray along a silhouette edge may go either way


def test_image_is_not_mirrored():
    left = looking_at(MODEL, box([2, 0.8, 0.4], [0.2, 0.2, 0.2])) > 0
    above = looking_at(MODEL, box([2, 0.0, 1.5], [0.2, 0.2, 0.2])) > 0
    assert left[:, :32].any()
    assert not left[:, 32:].any()
    assert above[:24].any()
    assert not above[24:].any()


@pytest.mark.parametrize("faces", [[[0, 1, 2], [0, 2, 3]], [[2, 1, 0], [3, 2, 0]]])
def test_a_sheet_hides_what_is_behind_whichever_way_it_faces(faces):
    sheet = trimesh.Trimesh(
        [[1.5, -9, -9], [1.5, 9, -9], [1.5, 9, 9], [1.5, -9, 9]], faces, process=False
    )
    depth = looking_at(LEVEL, sheet, box([3, 0, 0.5], [0.3, 0.3, 0.3]))
    np.testing.assert_allclose(depth, 1.5, atol=1e-4)


def test_no_ray_slips_between_triangles():
    """Rays aimed at the edges from inside a closed shell."""
    shell = trimesh.creation.icosphere(subdivisions=4, radius=2.0)
    rng = np.random.default_rng(0)
    start, end = np.moveaxis(shell.vertices[shell.edges_unique], 1, 0)
    origin = np.array([0.3, -0.2, 0.1])
    rays = start + rng.random((len(start), 1)) * (end - start) - origin
    limits = np.full(len(rays), np.inf, dtype=np.float32)
    hits = RayCaster(shell.vertices, shell.faces).cast(origin, rays.astype(np.float32), limits)
    np.testing.assert_allclose(hits, 1.0, atol=1e-4)


def test_a_closed_shell_fills_the_image():
    shell = trimesh.creation.icosphere(subdivisions=5, radius=2.0)
    fine = CameraModel(width=640, height=480, position=(0.011, 0.007, 0.003))
    assert looking_at(fine, shell).min() > 0.8


def test_an_obstacle_around_the_camera_blinds_it():
    depth = looking_at(LEVEL, box([0, 0, 0.5], [0.05, 0.05, 0.05]), box([3, 0, 0], [0.1, 9, 9]))
    assert not depth.any()


def test_what_is_out_of_range_is_invalid():
    assert not looking_at(LEVEL, box([0.2, 0, 0.5], [0.05, 9, 9])).any()
    assert not looking_at(LEVEL, box([5.2, 0, 0.5], [0.1, 99, 99])).any()
    assert looking_at(LEVEL, box([5.0, 0, 0.5], [0.1, 99, 99])).all()


def test_the_arm_is_in_the_image_like_any_surface(robot):
    """Per-link hierarchies and culling give what one mesh of everything gives."""
    wall = box([4, 0, 0], [0.1, 9, 9])
    camera, reference = DepthCamera(MODEL), DepthCamera(MODEL)
    camera.set_scene(*mesh_of(wall))
    camera.set_robot(ARM)
    rng, covered = np.random.default_rng(5), []
    for _ in range(40):
        configuration = np.r_[rng.uniform(-1, 1, 3), rng.uniform(ARM_LOWER, ARM_UPPER)]
        state = robot.state(configuration)
        T = state.T_world_base @ MODEL.T_base_camera
        placed = [
            trimesh.Trimesh(v, f, process=False).apply_transform(pose)
            for (v, f), pose in zip(ARM, state.link_poses[1:], strict=True)
        ]
        reference.set_scene(*mesh_of(wall, *placed))
        seen = camera.render(T, state.link_poses[1:])
        assert (np.abs(seen - reference.render(T)) > 1e-4).sum() <= 2
        covered.append((seen < 1.3).mean())
    assert max(covered) > 0.2  # some poses fill much of the image, or this would test nothing


def test_the_hand_is_seen_at_its_distance(robot):
    camera = DepthCamera(MODEL)
    camera.set_scene(*mesh_of(box([0, 0, -1], [9, 9, 0.1])))
    camera.set_robot(ARM)
    arm = ARM_READY + np.array([0, 0.9, 0, 0.2, 0, 0, 0])  # reaches down in front of the camera
    state = robot.state(np.r_[0, 0, 0, arm])
    depth = camera.render(MODEL.T_base_camera, state.link_poses[1:])
    hand = np.linalg.inv(MODEL.T_base_camera) @ state.link_poses[8, :, 3]
    fx, fy = MODEL.focal_lengths
    column, row = int(fx * hand[0] / hand[2] + 32), int(fy * hand[1] / hand[2] + 24)
    assert 0 < hand[2] - depth[row, column] < 0.1  # the surface is in front of the hand's origin


def windows_of(bodies, poses=None):
    """Pixel windows of bodies given by their corners; the camera looks along the world's z axis."""
    poses = np.tile(np.eye(4), (len(bodies), 1, 1)) if poses is None else poses
    starts = np.cumsum([0, *map(len, bodies)])
    return pixel_windows(
        np.concatenate(bodies), starts, np.eye(4), poses, MODEL.focal_lengths, (48, 64)
    )


def test_pixel_windows_hold_the_pixels_whose_rays_hit_a_body_and_few_more():
    rng = np.random.default_rng(0)
    kept, straddling = 0, 0
    for _ in range(300):
        corners = rng.uniform([-1, -1, -0.5], [1, 1, 1.5]) + rng.uniform(-0.4, 0.4, (8, 3))
        body = trimesh.convex.convex_hull(corners)
        rays = MODEL.rays.reshape(-1, 3).astype(np.float32)
        limits = np.full(len(rays), 1e3, dtype=np.float32)
        hits = RayCaster(body.vertices, body.faces).cast(np.zeros(3), rays, limits)
        rows, columns = np.nonzero(hits.reshape(48, 64) < 1e3)
        (top, bottom, left, right) = windows_of([corners])[0]
        if not len(rows):
            continue
        kept += 1
        assert top <= rows.min()
        assert rows.max() < bottom
        assert left <= columns.min()
        assert columns.max() < right
        if corners[:, 2].min() < 0:
            straddling += 1
        elif 0 < rows.min() <= rows.max() < 47 and 0 < columns.min() <= columns.max() < 63:
            # A corner beyond the outermost ray need not be hit by it.
            assert np.abs([rows.min() - top, bottom - 1 - rows.max()]).max() <= 4
            assert np.abs([columns.min() - left, right - 1 - columns.max()]).max() <= 4
    assert kept > 100
    assert straddling > 10


def test_pixel_windows_are_empty_out_of_sight():
    box_corners = np.array(trimesh.creation.box().vertices)
    ahead, above, beside, behind = (
        0.1 * box_corners + place for place in ([0, 0, 2], [0, -3, 2], [5, 0, 2], [0, 0, -2])
    )
    windows = windows_of([ahead, above, beside, behind])
    empty = (windows[:, 0] >= windows[:, 1]) | (windows[:, 2] >= windows[:, 3])
    assert empty.tolist() == [False, True, True, True]
    moved = np.tile(np.eye(4), (1, 1, 1))
    moved[0, :3, 3] = [0, 3, 0]
    np.testing.assert_array_equal(windows_of([above], moved)[0], windows[0])


def test_rendering_without_a_scene_or_with_missing_poses_is_refused():
    camera = DepthCamera(MODEL)
    with pytest.raises(RuntimeError, match="set_scene"):
        camera.render(np.eye(4))
    camera.set_scene(*mesh_of(box([2, 0, 0], [1, 1, 1])))
    camera.set_robot(ARM)
    with pytest.raises(ValueError, match="expected 8 poses, got 0"):
        camera.render(np.eye(4))


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((3, 2)), [[0, 1, 2]], "vertices: expected shape"),
        (np.zeros((3, 3)), [[0, 1, 2, 3]], "faces: expected shape"),
        (np.zeros((3, 3)), [[0, 1, 3]], "faces: expected indices of 3 vertices"),
        (np.zeros((3, 3)), [[0, 1, -1]], "faces: expected indices of 3 vertices"),
    ],
)
def test_malformed_meshes_are_refused(vertices, faces, message):
    with pytest.raises(ValueError, match=message):
        RayCaster(vertices, faces)


def test_rays_end_at_their_limits():
    caster = RayCaster(*mesh_of(box([2, 0, 0], [0.5, 1, 1])))
    rays = np.array([[1, 0, 0], [1, 0, 0], [0, 0, 1]], dtype=np.float32)
    limits = np.array([9, 1, 9], dtype=np.float32)
    np.testing.assert_allclose(caster.cast(np.zeros(3), rays, limits), [1.5, 1, 9], atol=1e-6)
    np.testing.assert_allclose(limits, [9, 1, 9])  # the caller's array is left alone
