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
