"""The MuJoCo model to simulate has the dynamics of the robot to control."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from opspace.robots import load_robot
from opspace.robots.mujoco_model import model_of, mujoco_model
from tests.robots.samples import NAMES, URDF, random_state


@pytest.mark.parametrize("name", NAMES)
def test_the_plant_accelerates_as_the_robot_says(name: str) -> None:
    robot = load_robot(name)
    assert robot.source is not None
    model = model_of(robot)
    assert (model.nq, model.nv) == (robot.nq, robot.nv)
    data = mujoco.MjData(model)
    q, v = random_state(robot, np.random.default_rng(40))
    robot.update(q, v)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    np.testing.assert_allclose(M, robot.M, atol=1e-9)
    np.testing.assert_allclose(data.qfrc_bias, robot.bias, atol=1e-8)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j) for j in range(model.njnt)]
    assert names[-1] == robot.joint_names[-1]


@pytest.mark.parametrize("name", NAMES)
def test_what_is_drawn_touches_nothing_and_is_lit(name: str) -> None:
    robot = load_robot(name)
    assert robot.source is not None
    model = mujoco_model(robot.source, robot.floating_base, robot.locked_joints)
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    assert model.nlight > 0
    assert model.ngeom > robot.nv // 2
    assert (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).sum() == 1


def test_limits_reach_the_plant(files: dict[str, Path]) -> None:
    model = mujoco_model(files["oddity"])
    assert list(model.jnt_limited) == [1, 0, 1]
    np.testing.assert_array_equal(model.jnt_range[[0, 2]], [[-1.0, 0.5], [-0.2, 0.4]])
    assert list(model.jnt_actfrclimited) == [1, 1, 0]
    np.testing.assert_array_equal(model.jnt_actfrcrange[:2], [[-5, 5], [-12, 12]])


def test_scenery_is_added_only_where_there_is_none(files: dict[str, Path], tmp_path: Path) -> None:
    bare = mujoco_model(files["medley"])
    assert bare.nlight == 1
    assert bare.ntex == 2
    furnished = tmp_path / "furnished.xml"
    text = files["medley"].read_text()
    floor = '<worldbody><light name="mine"/><geom name="mine" type="plane" size="1 1 1"/>'
    furnished.write_text(text.replace("<worldbody>", floor))
    model = mujoco_model(furnished)
    assert model.nlight == 1
    assert model.light("mine").id == 0
    assert (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).sum() == 1


def test_joints_can_be_locked(files: dict[str, Path]) -> None:
    model = mujoco_model(str(files["oddity"]), locked_joints=["slider"])
    assert model.nv == 2
    assert mujoco_model(files["medley"], locked_joints=["turn"]).nv == 11


def test_a_massless_moving_link_is_carried(tmp_path: Path) -> None:
    path = tmp_path / "massless.urdf"
    start = URDF.index('<link name="wheel">')
    end = URDF.index('<link name="slider">')
    path.write_text(URDF[:start] + '<link name="wheel"/>' + URDF[end:])
    one, other = load_robot(path), load_robot(path, backend="mujoco")
    q, v = random_state(one, np.random.default_rng(41))
    one.update(q, v)
    other.update(q, v)
    np.testing.assert_allclose(one.M, other.M, atol=1e-10)
    np.testing.assert_allclose(one.bias, other.bias, atol=1e-10)
