"""Shapes are where the robot's frames are."""

import numpy as np
import pytest

from opspace.errors import ModelError
from opspace.robots import available_robots, load_robot
from opspace.robots.visuals import visuals_of
from opspace.tasks.rotation import matrix_from_quaternion

INSTALLED = [info.name for info in available_robots() if info.installed]


def rotations(quaternions):
    return np.array([matrix_from_quaternion(tuple(q)) for q in quaternions])


@pytest.mark.parametrize("name", INSTALLED)
def test_every_robot_has_shapes_of_triangles(name):
    robot = load_robot(name)
    visuals = visuals_of(robot)
    positions, quaternions = visuals.poses(robot.q_reference)
    assert len(visuals.shapes) == len(positions) == len(quaternions) > 2
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=1e-9)
    for shape in visuals.shapes:
        assert shape.faces.min() >= 0
        assert shape.faces.max() < len(shape.vertices)
        assert np.isfinite(shape.vertices).all()


@pytest.mark.parametrize(
    "name", [n for n in ("puma560", "panda", "ur5", "solo12") if n in INSTALLED]
)
def test_every_shape_moves_with_one_frame_of_the_robot(name):
    """Seen from the frame that it belongs to, a shape is at rest, whatever the configuration."""
    robot = load_robot(name)
    visuals, rng = visuals_of(robot), np.random.default_rng(1)
    seen = []
    for _ in range(3):
        q = robot.integrate(robot.q_reference, rng.uniform(-0.5, 0.5, robot.nv), 1.0)
        robot.update(q, np.zeros(robot.nv))
        frames = range(len(robot.frame_names))
        R = np.array([robot.rotation(k) for k in frames])
        p = np.array([robot.position(k) for k in frames])
        positions, quaternions = visuals.poses(q)
        offsets = np.einsum("fji,fsj->sfi", R, positions[None] - p[:, None])
        turns = np.einsum("fji,sjk->sfik", R, rotations(quaternions))
        seen.append(np.concatenate([offsets, turns.reshape(*offsets.shape[:2], 9)], axis=2))
    spread = np.ptp(seen, axis=0).max(axis=2)
    assert spread.min(axis=1).max() < 1e-9
    assert spread.max() > 0.01


def test_a_urdf_without_its_meshes_is_shown_as_capsules(tmp_path):
    path = tmp_path / "two.urdf"
    link = (
        '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        '</inertial><visual><geometry><mesh filename="package://gone/x.dae"/></geometry></visual>'
    )
    path.write_text(
        f'<robot name="two"><link name="a">{link}</link><link name="b">{link}</link>'
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
        '<origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>'
    )
    assert len(visuals_of(load_robot(path)).shapes) >= 1


def test_a_robot_without_a_file_cannot_be_shown():
    robot = load_robot("puma560")
    robot.source = None
    with pytest.raises(ModelError, match="puma560"):
        visuals_of(robot)


LINKS = """<mujoco><asset><mesh name="hull" file="gone.stl"/>
<material name="glass" rgba="1 1 1 {clear}"/>
</asset><worldbody><geom type="plane" size="1 1 1"/><body pos="0 0 .3">
<inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/><joint name="a" axis="0 1 0"/>{one}
<body pos="0 0 .4"><inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/><joint name="b" axis="0 1 0"/>
{other}</body></body></worldbody></mujoco>"""


@pytest.mark.filterwarnings("ignore::opspace.ModelWarning")
@pytest.mark.parametrize(
    ("one", "other", "clear", "shown"),
    [
        ('<geom type="mesh" mesh="hull" contype="0" conaffinity="0"/>', "", 1, 3),
        ('<geom size=".1" group="3"/>', '<geom type="capsule" size=".1 .1" group="4"/>', 1, 3),
        ("", "", 1, 3),
        ('<geom size=".1" material="glass"/>', '<geom size=".1" rgba="1 0 0 0"/>', 0, 3),
        ('<geom size=".1" material="glass"/>', '<geom size=".1" group="3"/>', 1, 1),
        ('<geom size=".1"/>', '<geom type="mesh" mesh="hull"/>', 1, 1),
    ],
)
def test_an_mjcf_file_of_which_nothing_is_seen_is_shown_as_capsules(
    tmp_path, one, other, clear, shown
):
    """A ball at each joint and a capsule between them; what the file shows is shown alone."""
    path = tmp_path / "bare.xml"
    path.write_text(LINKS.format(one=one, other=other, clear=clear))
    visuals = visuals_of(load_robot(path))
    assert len(visuals.shapes) == shown
    positions, _ = visuals.poses(np.zeros(2))
    assert {round(float(z), 9) for z in positions[:, 2]} == (
        {0.3, 0.5, 0.7} if shown > 1 else {0.3}
    )
