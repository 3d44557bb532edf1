"""Distances of other robots than this package's: primitives, meshes, and bad input."""

import igl
import numpy as np
import pytest
import trimesh

from horf_env.errors import ConfigurationError, GeometryError, MissingAssetError, RobotFileError
from horf_env.robot import UrdfRobot
from horf_env.robot.description import mesh_root
from horf_env.sdf import RobotSdf

TINY = """<robot name="tiny">
  <link name="root"><collision><geometry><box size="0.4 0.3 0.2"/></geometry></collision></link>
  <link name="bracket"/>
  <joint name="weld" type="fixed"><parent link="root"/><child link="bracket"/></joint>
  <link name="pole"><collision><origin xyz="0 0 0.3"/>
    <geometry><cylinder radius="0.05" length="0.6"/></geometry></collision></link>
  <joint name="turn" type="revolute"><parent link="bracket"/><child link="pole"/>
    <origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <link name="ball"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="pole"/><child link="ball"/>
    <origin xyz="0.2 0 0.5"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <link name="tool"><collision><geometry>{tool}</geometry></collision></link>
  <joint name="wrist" type="revolute"><parent link="ball"/><child link="tool"/>
    <origin xyz="0.2 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""
MESH = '<mesh filename="package://tool.stl" scale="0.5 0.5 0.5"/>'


@pytest.fixture
def write_urdf(tmp_path):
    def write(text):
        path = tmp_path / "robot.urdf"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def tiny(write_urdf, tmp_path):
    trimesh.creation.box(extents=(0.2, 0.1, 0.1)).export(tmp_path / "tool.stl")
    robot = UrdfRobot(write_urdf(TINY.format(tool=MESH)))
    return robot, RobotSdf.load(robot, cache_folder=tmp_path)


def test_links_without_a_joint_between_them_are_one_body(tiny):
    robot, _ = tiny
    assert robot.link_names == ("root", "pole", "ball", "tool")


def test_primitives_are_as_far_as_their_formulas_say_and_never_farther(tiny):
    robot, sdf = tiny
    state = robot.state(np.array([0.0, 0.3, 0.0]))
    point = np.array([[0.8, 0.5, 0.6]])
    found = sdf.query(point, state.configuration)
    box = np.linalg.norm(point[0] - [0.2, 0.15, 0.1])
    pole = np.hypot(0.8, 0.5) - 0.05
    ball = np.linalg.norm(point[0] - [0.5, 0.0, 0.6]) - 0.1
    tool = np.linalg.norm(np.maximum(np.abs(point[0] - [0.7, 0.0, 0.6]) - [0.05, 0.025, 0.025], 0))
    expected = np.array([box, pole, ball, tool])
    assert (found.distance <= expected + 1e-9).all()
    np.testing.assert_allclose(found.distance, expected, atol=6e-4)


def central_differences(sdf, robot, q, points, step=1e-6):
    columns = [
        (sdf.query(points, q + e).distance - sdf.query(points, q - e).distance) / (2 * step)
        for e in step * np.eye(len(q))
    ]
    return np.transpose(columns)


def test_gradients_match_central_differences(tiny):
    robot, sdf = tiny
    q, point = np.array([0.4, 0.5, -0.3]), np.array([[0.9, 0.6, 0.9]])
    found = sdf.query(point, q)
    np.testing.assert_allclose(found.gradient, central_differences(sdf, robot, q, point), atol=1e-6)


def test_a_kuka_iiwa_agrees_with_brute_force(tmp_path):
    robot = UrdfRobot(mesh_root() / "kuka_iiwa" / "model.urdf")
    sdf = RobotSdf.load(robot, cache_folder=tmp_path)
    rng = np.random.default_rng(0)
    q = rng.uniform(robot.lower, robot.upper)
    points = rng.uniform([-0.8, -0.8, 0.0], [0.8, 0.8, 1.3], (500, 3))
    state, found = robot.state(q), sdf.query(points, q)
    assert found.gradient.shape == (8, 7)
    for body, parts in enumerate(robot.parts("collision")):
        R, t = state.link_poses[body, :3, :3], state.link_poses[body, :3, 3]
        (part,) = parts
        local = (points - t) @ R
        squared, _, _ = igl.point_mesh_squared_distance(local, part.vertices, part.faces)
        inside = igl.fast_winding_number(part.vertices, part.faces, local) > 0.5
        distance = np.where(inside, -1, 1) * np.sqrt(squared)
        np.testing.assert_allclose(sdf.link_distance(body, local), distance, atol=1e-9)
    np.testing.assert_allclose(
        found.gradient, central_differences(sdf, robot, q, points), atol=1e-6
    )


def test_visual_meshes_of_a_kuka_iiwa_agree_with_brute_force(tmp_path):
    robot = UrdfRobot(mesh_root() / "kuka_iiwa" / "model.urdf")
    bodies = robot.parts("visual")[5:7]  # those of the whole robot take 5 s
    sdf, rng = RobotSdf(robot, bodies, cache_folder=tmp_path), np.random.default_rng(0)
    for body, (part,) in enumerate(bodies):
        corners = part.vertices.min(axis=0) - 0.05, part.vertices.max(axis=0) + 0.05
        points = rng.uniform(*corners, (500, 3))
        found = sdf.link_distance(body, points)
        squared, _, _ = igl.point_mesh_squared_distance(points, part.vertices, part.faces)
        error = np.abs(found - np.sqrt(squared))[found > 0.0]
        assert len(error) > 250
        assert error.mean() < 3e-5


def test_a_missing_mesh_is_named(write_urdf, tmp_path):
    robot = UrdfRobot(write_urdf(TINY.format(tool=MESH)))
    with pytest.raises(MissingAssetError, match=r"tool\.stl"):
        RobotSdf.load(robot, cache_folder=tmp_path)


def test_a_mesh_without_faces_is_named(write_urdf, tmp_path):
    (tmp_path / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    robot = UrdfRobot(write_urdf(TINY.format(tool='<mesh filename="points.obj"/>')))
    with pytest.raises(GeometryError, match=r"'tool': .*points\.obj has no faces"):
        RobotSdf.load(robot, cache_folder=tmp_path)


def test_a_flat_mesh_is_named(write_urdf, tmp_path):
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    robot = UrdfRobot(write_urdf(TINY.format(tool='<mesh filename="flat.obj"/>')))
    with pytest.raises(GeometryError, match=r"'tool': .*flat"):
        RobotSdf.load(robot, cache_folder=tmp_path)


@pytest.mark.parametrize(
    "tool", ['<box size="0.1 0.1 0"/>', '<mesh filename="robot.urdf"/>', '<mesh filename="a.foo"/>']
)
def test_geometry_without_volume_or_of_unknown_format_is_named(write_urdf, tmp_path, tool):
    (tmp_path / "a.foo").write_text("no mesh")
    robot = UrdfRobot(write_urdf(TINY.format(tool=tool)))
    with pytest.raises(GeometryError, match=r"'tool': .*(flat; a body needs|try STL or OBJ)"):
        RobotSdf.load(robot, cache_folder=tmp_path)


def test_a_body_without_collision_geometry_is_named(write_urdf, tmp_path):
    shown = '<visual><geometry><sphere radius="0.1"/></geometry></visual>'
    solid = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    robot = UrdfRobot(write_urdf(TINY.format(tool='<box size="1 1 1"/>').replace(solid, shown)))
    with pytest.raises(GeometryError, match="'ball': no collision geometry"):
        RobotSdf.load(robot, cache_folder=tmp_path)


def test_a_robot_without_any_geometry_is_refused(write_urdf):
    with pytest.raises(GeometryError, match="'root': no link of the robot has geometry"):
        UrdfRobot(write_urdf('<robot name="ghost"><link name="root"/></robot>'))


@pytest.mark.parametrize("joints", [0, 1])
def test_robots_with_one_joint_and_with_none(write_urdf, tmp_path, joints):
    link = '<link name="{}"><collision><geometry><box size="2 2 2"/></geometry></collision></link>'
    joint = """<joint name="turn" type="revolute"><parent link="a"/><child link="b"/>
        <origin xyz="3 0 0"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>"""
    text = link.format("a") + (link.format("b") + joint if joints else "")
    robot = UrdfRobot(write_urdf(f'<robot name="simple">{text}</robot>'))
    sdf = RobotSdf.load(robot, cache_folder=tmp_path)
    found = sdf.query(np.array([[3.5, 2.0, 0.0]]), np.zeros(joints))
    np.testing.assert_allclose(found.distance, [np.hypot(2.5, 1.0), 1.0][: joints + 1])
    # The corner that comes nearer by 0.5 m/rad is above the point: only its height counts.
    np.testing.assert_allclose(found.gradient, np.array([[0.0], [-0.5]])[: joints + 1, :joints])


def test_a_body_without_visual_geometry_is_named(tiny, tmp_path):
    robot, _ = tiny
    with pytest.raises(GeometryError, match="'root': no visual geometry"):
        RobotSdf.load(robot, "visual", cache_folder=tmp_path)


def test_bad_configurations_are_refused(tiny):
    _, sdf = tiny
    point = np.ones((1, 3))
    with pytest.raises(
        ConfigurationError, match=r"'slide': 1\.5 is outside of its limits \[0, 1\]"
    ):
        sdf.query(point, np.array([0.0, 1.5, 0.0]))
    with pytest.raises(ConfigurationError, match="expected 3 finite numbers"):
        sdf.query(point, np.array([0.0, np.nan, 0.0]))


def test_a_missing_file_and_a_joint_without_limits_are_refused(write_urdf, tmp_path):
    with pytest.raises(MissingAssetError, match=r"none\.urdf"):
        UrdfRobot(tmp_path / "none.urdf")
    endless = TINY.format(tool='<box size="1 1 1"/>').replace("revolute", "continuous", 1)
    with pytest.raises(RobotFileError, match=r"'turn' is continuous, supported are .*revolute"):
        UrdfRobot(write_urdf(endless))


@pytest.mark.parametrize("text", ["no URDF", "<robot/>", TINY.format(tool="<cone/>")])
def test_a_file_that_is_no_urdf_is_named(write_urdf, text):
    with pytest.raises(RobotFileError, match=r"robot\.urdf: no valid URDF"):
        UrdfRobot(write_urdf(text))
