"""A model in memory is the robot that its file would be."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from opspace import ModelError, ModelWarning, load_robot
from opspace.robots import Robot
from opspace.robots.adapter import AdapterBase
from opspace.robots.catalogue import CATALOGUE, locate
from tests.robots.hands_and_scenes import GRIPPER, MOTORS, arm_on_a_table, arm_with_fingers
from tests.robots.samples import BACKENDS, INSTALLED, MJCF, URDF, random_state
from tests.robots.test_controlled_joints import HELD, coupled_files

OWN_FORCES = {
    "gravcomp": {"hand": '<body name="tray" gravcomp=".7" pos=".3 0 0"><geom size=".1"/></body>'},
    "spring": {"hand": '<body pos=".3 0 0"><joint name="s" stiffness="7" springref="20"/>'
               '<geom size=".1"/></body>', "motors": MOTORS + '<motor joint="s"/>'},
    "servos": {"motors": '<position joint="j1" kp="90" forcerange="-40 30"/><motor joint="j2" '
               'gear="3" ctrlrange="-2 5" ctrllimited="true"/>'},
    "keys": {"keys": '<keyframe><key name="home" qpos=".3 .8"/><key qpos="0 1"/></keyframe>'},
}  # fmt: skip


def quiet(source: Any, **options: Any) -> AdapterBase:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        robot = load_robot(source, **options)
    assert isinstance(robot, AdapterBase)
    return robot


def check_same(one: Robot, other: Robot, atol: float = 1e-9) -> None:
    assert isinstance(one, AdapterBase)
    assert isinstance(other, AdapterBase)
    for what in ("joint_names", "joint_units", "tool", "actuated", "floating_base"):
        np.testing.assert_equal(getattr(one, what), getattr(other, what), what)
    assert set(one.frame_names) == set(other.frame_names)
    assert one.description.warnings == other.description.warnings
    for what in ("q_reference", "q_lower", "q_upper", "velocity_limit", "torque_limit"):
        np.testing.assert_allclose(getattr(one, what), getattr(other, what), atol=atol)
    assert one.description.locked.keys() == other.description.locked.keys()
    assert one.description.couplings == other.description.couplings
    for name, q in one.configurations.items():
        np.testing.assert_allclose(other.configurations[name], q, atol=atol)
    rng = np.random.default_rng(7)
    for _ in range(2):
        state = random_state(one, rng)
        one.update(*state)
        other.update(*state)
        np.testing.assert_allclose(one.M, other.M, atol=atol)
        np.testing.assert_allclose(one.bias, other.bias, atol=10.0 * atol)
        for name in one.frame_names:
            np.testing.assert_allclose(one.position(name), other.position(name), atol=atol)
            np.testing.assert_allclose(one.rotation(name), other.rotation(name), atol=atol)


def mjcf_files(folder: Path) -> dict[str, Path]:
    found = {"medley": folder / "medley.xml"}
    found["medley"].write_text(MJCF)
    scenes = {what: scene for what, (scene, _) in HELD.items()} | OWN_FORCES
    for number, (what, scene) in enumerate(scenes.items()):
        found[what] = arm_on_a_table(folder / f"s{number}.xml", **scene)
    return found | {k: p for k, p in coupled_files(folder).items() if p.suffix == ".xml"}


FROM_FILE: tuple[Callable[[str], Any], ...] = (
    mujoco.MjSpec.from_file,
    mujoco.MjModel.from_xml_path,
)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("read", FROM_FILE, ids=["MjSpec", "MjModel"])
def test_a_mujoco_model_is_what_its_file_is(tmp_path: Path, read: Any, backend: str) -> None:
    for path in mjcf_files(tmp_path).values():
        check_same(quiet(path, backend=backend), quiet(read(str(path)), backend=backend), 1e-12)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("name", [n for n in INSTALLED if locate(CATALOGUE[n]).suffix == ".urdf"])
def test_a_pinocchio_model_is_what_its_file_is(name: str, backend: str) -> None:
    path = locate(CATALOGUE[name])
    locked = ["panda_finger*"] if name == "panda" else []  # Pinocchio forgets who mimics whom
    model = pin.buildModelFromUrdf(str(path))
    same = {"backend": backend, "locked": locked}
    check_same(quiet(path, **same), quiet(model, **same))
    if not model.existBodyName("world"):
        model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
        check_same(quiet(path, floating_base=True, **same), quiet(model, **same))


@pytest.mark.parametrize("backend", BACKENDS)
def test_every_argument_is_as_for_a_file(tmp_path: Path, backend: str) -> None:
    urdf = tmp_path / "oddity.urdf"
    urdf.write_text(URDF)
    fingers = arm_with_fingers(tmp_path / "r.urdf")
    hand = arm_on_a_table(tmp_path / "a.xml", hand=GRIPPER)
    cases = (
        (urdf, {"locked": {"slider": 0.1}, "tool": "wheel"}),
        (urdf, {"joints": ["zeta", "alpha"], "reference": {"alpha": -0.3}}),
        (urdf, {"floating_base": True, "locked": {"zeta": -1.2}}),
        (fingers, {"joints": ["j?"], "tool": "f"}),
        (hand, {"locked": {"left_driver": 0.3}, "joints": ["j*", "left_tip"]}),
        (hand, {"reference": [0.2, -0.4]}),
        (hand, {"floating_base": True}),
    )
    for path, given in cases:
        if path.suffix == ".urdf":
            models = [pin.buildModelFromUrdf(str(path))]
        elif "floating_base" in given:
            continue  # a scene has several roots
        else:
            models = [read(str(path)) for read in FROM_FILE]
        for model in models:
            check_same(
                quiet(path, backend=backend, **given), quiet(model, backend=backend, **given)
            )


def test_a_pinocchio_model_made_by_hand() -> None:
    """Motors with inertia, a posture of its own, joints in another order, links without names."""
    model = pin.Model()
    model.name = "lift"
    place = pin.SE3(pin.utils.rotate("x", 0.3), np.array([0.1, 0.0, 0.4]))
    lift = model.addJoint(0, pin.JointModelPZ(), pin.SE3.Identity(), "lift")
    turn = model.addJoint(lift, pin.JointModelRUBZ(), place, "turn")
    arm = model.addJoint(turn, pin.JointModelRY(), place, "arm")
    left = model.addJoint(turn, pin.JointModelRX(), place, "a_second")
    for joint in (lift, turn, arm, left):
        model.appendBodyToJoint(joint, pin.Inertia.FromBox(2.0, 0.1, 0.2, 0.3), place)
    model.addFrame(pin.Frame("tcp", arm, 0, place, pin.FrameType.OP_FRAME))
    model.armature = np.array([3.0, 0.2, 0.1, 0.05])
    model.lowerPositionLimit[0], model.upperPositionLimit[0] = 0.0, 0.6
    q, v = np.array([0.2, np.cos(0.7), np.sin(0.7), -0.4, 0.9]), np.array([0.1, 2.0, -1.0, 0.5])
    model.referenceConfigurations["ready"] = q
    data = model.createData()
    M, bias = pin.crba(model, data, q), pin.nonLinearEffects(model, data, q, v)
    pin.framesForwardKinematics(model, data, q)
    for backend in BACKENDS:
        with pytest.warns(ModelWarning, match="order of a URDF, not of the model: lift, turn, a_s"):
            robot = load_robot(model, backend=backend)
        assert robot.joint_names == ("lift", "turn", "a_second", "arm")
        order = [0, 1, 3, 2]
        ready = robot.configurations["ready"]
        np.testing.assert_allclose(ready, [0.2, 0.7, 0.9, -0.4], atol=1e-12)
        robot.update(ready, v[order])
        np.testing.assert_allclose(robot.M, M[np.ix_(order, order)], atol=1e-9)
        np.testing.assert_allclose(robot.bias, bias[order], atol=1e-9)
        tip = data.oMf[model.getFrameId("tcp")].translation
        np.testing.assert_allclose(robot.position(robot.frame_id("tcp")), tip, atol=1e-9)


def test_what_cannot_be_read_from_memory_is_refused_by_name(tmp_path: Path) -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "base")
    with pytest.raises(ModelError, match="joint 'base' is a JointModelPlanar, not a hinge"):
        load_robot(model)
    heavy = pin.buildModelFromUrdf(str(arm_with_fingers(tmp_path / "r.urdf")))
    heavy.gravity.linear = np.array([0.0, 0.0, -1.6])
    with pytest.raises(ModelError, match="gravity other than"):
        load_robot(heavy)
    strung = arm_on_a_table(
        tmp_path / "a.xml",
        around='<site name="peg"/>',
        more='<tendon><spatial name="rope"><site site="peg"/><site site="wrist"/></spatial></tendon>',
    )
    with pytest.raises(ModelError, match="tendon rope runs through space: give the MjSpec"):
        load_robot(mujoco.MjModel.from_xml_path(str(strung)))
    assert quiet(mujoco.MjSpec.from_file(str(strung))).nv == 2
    still = mujoco.MjModel.from_xml_string("<mujoco model='rock'><worldbody/></mujoco>")
    with pytest.raises(ModelError, match="MjModel 'rock': the robot has no joint that moves"):
        load_robot(still)
    with pytest.raises(ModelError, match="not from a dict"):
        load_robot({})  # pyright: ignore[reportArgumentType]


def test_a_model_is_left_as_it_is(tmp_path: Path) -> None:
    path = arm_on_a_table(tmp_path / "a.xml", hand=GRIPPER)
    spec = mujoco.MjSpec.from_file(str(path))
    quiet(spec, joints=["j1"])
    assert spec.compile().nq == mujoco.MjModel.from_xml_path(str(path)).nq
