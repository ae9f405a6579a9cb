"""Joints without a motor are held and named, others follow, and the arm is controlled."""

from __future__ import annotations

import warnings
from pathlib import Path

import mujoco
import numpy as np
import pytest

import opspace as osc
from opspace import (
    InputError,
    ModelError,
    ModelWarning,
    ScenarioError,
    UnknownNameError,
    load_robot,
)
from opspace.robots import Robot
from opspace.robots.adapter import spread_of
from opspace.runs.check import check_robot
from opspace.scenario import scenario_from
from opspace.scenario.build import build_robot
from tests.cli.test_cli import run
from tests.robots.hands_and_scenes import GRIPPER, MOTORS, arm_on_a_table, arm_with_fingers
from tests.robots.samples import BACKENDS

TENDON = (
    '<tendon><fixed name="split"><joint joint="left_driver" coef=".5"/>'
    '<joint joint="right_driver" coef=".5"/></fixed></tendon>'
)
GRIP = MOTORS + '<motor name="grip" tendon="split"/>'
CUBE = '<body name="cube" pos="1 0 0"><freejoint/><geom type="box" size=".02 .02 .02"/></body>'
DOOR = '<body name="door" pos="0 1 0"><joint name="hinge" axis="0 0 1"/><geom size=".1"/></body>'
BALL = '<body name="lamp" pos=".3 0 0"><joint name="swivel" type="ball"/><geom size=".03"/></body>'

# What is at the arm's end and around it; what is said of it, and what is controlled beside j1, j2.
HELD = {
    "pendulum": (
        {"hand": '<body pos=".3 0 0"><joint name="swing"/><geom size=".03"/></body>'},
        ["no motor drives swing"],
    ),
    "second link": ({"motors": '<motor joint="j1" ctrlrange="-80 80"/>'}, ["no motor drives j2"]),
    "ball": ({"hand": BALL}, ["no motor drives swivel"]),
    "hand without motors": (
        {"hand": GRIPPER},
        ["no motor drives left_driver, left_tip, right_driver"],
    ),
    "tendon finger": (
        {"hand": GRIPPER, "more": TENDON, "motors": GRIP},
        ["no motor drives left_tip", "a tendon drives, together with others, left_driver, right"],
    ),
    "four-bar": (
        {
            "hand": GRIPPER,
            "motors": GRIP,
            "more": TENDON
            + '<equality><connect body1="left_pad" body2="right" anchor="0 0 0"/></equality>',
        },
        ["a closed loop (connect or weld) binds left_driver, left_tip, right_driver"],
    ),
    "bent": (
        {
            "hand": GRIPPER,
            "motors": MOTORS + '<motor joint="left_driver"/><motor joint="right_driver"/>',
            "more": '<equality><joint joint1="left_tip" joint2="left_driver" polycoef="0 1 1 0 0"/>'
            '<joint joint1="right_driver" joint2="left_driver"/></equality>',
        },
        ["an equality that is no straight line binds left_tip"],
    ),
    "cube": ({"around": CUBE}, ["nothing but contact moves cube"]),
    "door": ({"around": DOOR + CUBE}, ["no motor drives hinge", "nothing but contact moves cube"]),
    "mocap": (
        {
            "around": '<body name="hand_pose" mocap="true"/>',
            "more": '<equality><weld name="drag" body1="fore" body2="hand_pose"/></equality>',
        },
        ["the equality constraint drag is no part of the controller's model"],
    ),
}


def off_after(robot: Robot, q: np.ndarray, seconds: float = 0.4) -> float:
    """Hold a posture in the simulator and return how far the tool went, m."""
    plant = osc.Plant(robot, q)
    robot.update(q, np.zeros(robot.nv))
    start = robot.position(robot.frame_id(robot.tool)).copy()
    controller = osc.Controller(robot, osc.Stack([osc.PostureTask(q)]))
    osc.simulate(plant, controller, seconds)
    robot.update(plant.q, plant.v)
    return float(np.abs(robot.position(robot.frame_id(robot.tool)) - start).max())


def quiet(path: Path, **options: object) -> Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        return load_robot(path, **options)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("what", HELD)
@pytest.mark.parametrize("backend", BACKENDS)
def test_what_no_motor_moves_is_held_and_named(tmp_path: Path, what: str, backend: str) -> None:
    scene, sentences = HELD[what]
    path = arm_on_a_table(tmp_path / "arm.xml", **scene)
    with pytest.warns(ModelWarning) as caught:
        robot = load_robot(path, backend=backend)
    said = [str(w.message) for w in caught]
    for sentence in sentences:
        assert any(sentence in text for text in said), said
    assert all(any(s in text for s in sentences) for text in said), said
    own = {"second link": ("j1",), "bent": ("j1", "j2", "left_driver")}.get(what, ("j1", "j2"))
    assert robot.joint_names == own
    assert robot.actuated.all()
    assert set(sentences) <= {
        s for s in sentences if any(s in w for w in check_robot(robot).warnings)
    }
    assert off_after(robot, robot.q_reference) < 1e-5


def test_the_tool_is_short_of_a_hand_and_of_what_is_held(tmp_path: Path) -> None:
    for scene, _ in (HELD[what] for what in ("pendulum", "tendon finger", "four-bar", "bent")):
        assert quiet(arm_on_a_table(tmp_path / "a.xml", **scene)).tool == "wrist"
    second = quiet(arm_on_a_table(tmp_path / "b.xml", motors='<motor joint="j1"/>'))
    assert second.tool == "upper"
    both = MOTORS + '<motor joint="left_driver"/><motor joint="right_driver"/>'
    assert quiet(arm_on_a_table(tmp_path / "c.xml", hand=GRIPPER, motors=both)).tool == "wrist"
    follow = '<mimic joint="f1"/>'
    for files in ((), ("", follow), ("", follow, follow)):
        assert load_robot(arm_with_fingers(tmp_path / "d.urdf", *files)).tool in ("hand", "h")
    assert load_robot(tmp_path / "d.urdf").tool == "hand"
    assert load_robot(tmp_path / "d.urdf", tool="f").tool == "f"
    with pytest.raises(UnknownNameError, match="frame of r 'hnad'; did you mean 'hand'"):
        load_robot(tmp_path / "d.urdf", tool="hnad")
    # A joint in the middle of an arm does not end it.
    assert load_robot(tmp_path / "d.urdf", locked=["f*", "j1"]).tool == "hand"


def test_a_joint_is_held_where_it_is_asked_for(tmp_path: Path) -> None:
    """The simulator's own model at that position says where everything is, and what it weighs."""
    keys = (
        '<keyframe><key name="home" qpos=".1 .5 .2 -.3 .2 2 3 .1 0 1 0 0"/>'
        '<key name="up" qpos="-.1 .4 0 0 0 0 0 0 1 0 0 0"/></keyframe>'
    )
    path = arm_on_a_table(tmp_path / "a.xml", hand=GRIPPER, around=CUBE, keys=keys)
    full = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(full)
    data.qpos[:] = full.key_qpos[0]
    data.qpos[:3] = 0.4, -0.2, 0.6
    data.qvel[:2] = 0.7, -1.1
    mujoco.mj_forward(full, data)
    M = np.zeros((full.nv, full.nv))
    mujoco.mj_fullM(full, data, M)
    for backend in BACKENDS:
        robot = load_robot(path, backend=backend, joints=["j?"], locked={"left_driver": 0.6})
        assert robot.joint_names == ("j1", "j2")
        np.testing.assert_allclose(robot.q_reference, [0.1, 0.5])
        np.testing.assert_allclose(robot.configurations["up"], [-0.1, 0.4])
        robot.update(data.qpos[:2], data.qvel[:2])
        for name in ("left_pad", "right", "cube", "fore"):
            here = robot.position(robot.frame_id(name))
            np.testing.assert_allclose(here, data.body(name).xpos, atol=1e-12)
        np.testing.assert_allclose(robot.M, M[:2, :2], atol=1e-12)
        np.testing.assert_allclose(robot.bias, data.qfrc_bias[:2], atol=1e-12)


@pytest.mark.parametrize("locked", [{"j1": 0.7}, {"f1": -0.4, "j2": 1.2}, {"f3": 0.3}])
@pytest.mark.parametrize("backend", BACKENDS)
def test_a_held_joint_of_a_urdf_is_the_free_one_at_that_place(
    tmp_path: Path, locked: dict[str, float], backend: str
) -> None:
    path = arm_with_fingers(tmp_path / "r.urdf")
    full, robot = load_robot(path), load_robot(path, backend=backend, locked=locked)
    assert set(robot.locked_joints) == set(locked)
    kept = [i for i, name in enumerate(full.joint_names) if name not in locked]
    q, v = np.linspace(-0.5, 0.8, full.nv), np.zeros(full.nv)
    v[kept] = np.linspace(1.0, -0.7, len(kept))
    for name, value in locked.items():
        q[full.joint_names.index(name)] = value
    full.update(q, v)
    robot.update(q[kept], v[kept])
    with pytest.raises(
        InputError, match=rf"without coordinates: .*{next(iter(locked))}.* \(held\)"
    ):
        robot.check_state(q, v)
    np.testing.assert_allclose(robot.M, full.M[np.ix_(kept, kept)], atol=1e-12)
    np.testing.assert_allclose(robot.bias, full.bias[kept], atol=1e-11)
    for name in robot.frame_names:
        here, there = robot.frame_id(name), full.frame_id(name)
        np.testing.assert_allclose(robot.position(here), full.position(there), atol=1e-12)
        np.testing.assert_allclose(robot.rotation(here), full.rotation(there), atol=1e-12)


def test_joints_of_one_body_can_be_held_one_by_one(tmp_path: Path) -> None:
    """A base that slides twice and turns, with any of the three held."""
    path = tmp_path / "base.xml"
    path.write_text("""
<mujoco><compiler angle="radian"/><worldbody><body name="base" euler=".2 .3 0">
<joint name="x" type="slide" axis="1 0 0"/><joint name="turn" axis="0 1 1" pos=".1 0 .2" ref=".3"/>
<joint name="y" type="slide" axis="0 1 0"/><joint name="roll" axis="1 0 0" pos="0 .1 0"/>
<geom type="box" size=".1 .2 .3"/><body pos="0 0 .4"><joint name="arm" axis="0 1 0"/>
<geom type="box" size=".1 .1 .1"/><site name="tip" pos=".3 0 0"/></body></body></worldbody></mujoco>
""")
    full = load_robot(path)
    names = full.joint_names
    for held in (["x"], ["turn"], ["y"], ["roll"], ["turn", "roll"], ["x", "y"]):
        q, v = np.linspace(-0.6, 0.9, 5), np.linspace(0.4, -1.0, 5)
        kept = [i for i, name in enumerate(names) if name not in held]
        v[[names.index(name) for name in held]] = 0.0
        full.update(q, v)
        robot = load_robot(path, locked={name: q[names.index(name)] for name in held})
        robot.update(q[kept], v[kept])
        tip, there = robot.frame_id("tip"), full.frame_id("tip")
        np.testing.assert_allclose(robot.position(tip), full.position(there), atol=1e-12)
        np.testing.assert_allclose(robot.M, full.M[np.ix_(kept, kept)], atol=1e-12)
        np.testing.assert_allclose(robot.bias, full.bias[kept], atol=1e-10)


COUPLED = {
    "mjcf, one": '<joint joint1="left_driver" joint2="right_driver"/>',
    "mjcf, the driven one leads": '<joint joint1="left_driver" joint2="left_tip" polycoef="0 -2"/>',
    "mjcf, chain": '<joint joint1="left_tip" joint2="left_driver" polycoef=".1 -.5"/>'
    '<joint joint1="right_driver" joint2="left_driver" polycoef="0 .8"/>',
}


def coupled_files(folder: Path) -> dict[str, Path]:
    found = {}
    for number, (what, equality) in enumerate(COUPLED.items()):
        motors = MOTORS + (
            '<motor joint="left_driver"/>' if number else '<motor joint="right_driver"/>'
        )
        found[what] = arm_on_a_table(
            folder / f"c{number}.xml",
            hand=GRIPPER,
            motors=motors,
            more=f"<equality>{equality}</equality>",
        )
    same, half = '<mimic joint="f1"/>', '<mimic joint="f1" multiplier="-.5" offset=".2"/>'
    chain = '<mimic joint="f2" multiplier="1.5"/>'
    for number, mimics in enumerate((("", same), ("", half, same), ("", half, chain))):
        found[f"urdf {number}"] = arm_with_fingers(folder / f"u{number}.urdf", *mimics)
    return found


@pytest.mark.parametrize("what", [*COUPLED, "urdf 0", "urdf 1", "urdf 2"])
def test_joints_that_follow_move_with_their_leader(tmp_path: Path, what: str) -> None:
    path = coupled_files(tmp_path)[what]
    one, other = quiet(path), quiet(path, backend="mujoco")
    spread = spread_of(one)
    assert spread is not None
    assert len(check_robot(one).coupled) == len(spread.offset) - one.nv > 0
    rng = np.random.default_rng(3)
    q, v = one.q_reference + 0.1 * rng.standard_normal(one.nv), rng.standard_normal(one.nv)
    for robot in (one, other):
        robot.update(q, v)
        with pytest.raises(InputError, match=r"without coordinates: .*(following others|held)\)"):
            robot.check_state(spread.offset, spread.offset)
    np.testing.assert_allclose(one.M, other.M, atol=1e-12)
    np.testing.assert_allclose(one.bias, other.bias, atol=1e-11)
    step = 1e-6
    for name in one.frame_names:
        frame = one.frame_id(name)
        one.update(q, v)
        J, drift = one.jacobian(frame).copy(), one.drift(frame).copy()
        ends = []
        for sign in (1.0, -1.0):
            one.update(one.integrate(q, v, sign * step), v)
            ends.append((one.position(frame).copy(), one.jacobian(frame) @ v))
        np.testing.assert_allclose(J[:3] @ v, (ends[0][0] - ends[1][0]) / 2 / step, atol=1e-7)
        np.testing.assert_allclose(drift, (ends[0][1] - ends[1][1]) / 2 / step, atol=1e-6)
    goal = one.q_reference.copy()
    goal[-1] += 0.25
    plant = osc.Plant(one, one.q_reference)
    osc.simulate(plant, osc.Controller(one, osc.Stack([osc.PostureTask(goal)])), 1.5)
    np.testing.assert_allclose(plant.q, goal, atol=1e-3)
    np.testing.assert_allclose(spread.positions(plant.q), plant.data.qpos, atol=1e-3)


def test_followers_keep_within_their_own_limits(tmp_path: Path) -> None:
    half = '<mimic joint="f1" multiplier="-4" offset=".2"/>'
    robot = load_robot(arm_with_fingers(tmp_path / "r.urdf", "", half))
    k = robot.joint_names.index("f1")
    np.testing.assert_allclose([robot.q_lower[k], robot.q_upper[k]], [-0.45, 0.55])
    assert robot.velocity_limit[k] == 0.75
    far = '<mimic joint="f1" multiplier="0.1" offset="5"/>'
    with pytest.raises(ModelError, match="no position of joint 'f1' keeps f2, which follow"):
        load_robot(arm_with_fingers(tmp_path / "r.urdf", "", far))


def test_followers_of_a_held_joint_are_held_where_it_puts_them(tmp_path: Path) -> None:
    half = '<mimic joint="f1" multiplier="-.5" offset=".2"/>'
    path = arm_with_fingers(tmp_path / "r.urdf", "", half, '<mimic joint="f2" multiplier="2"/>')
    robot = load_robot(path, locked={"f1": 0.6})
    assert robot.joint_names == ("j1", "j2")
    held = check_robot(robot).locked
    assert held == pytest.approx({"f1": 0.6, "f2": -0.1, "f3": -0.2})
    assert off_after(robot, np.array([0.3, -0.4])) < 1e-5


def test_one_of_two_arms_is_controlled(tmp_path: Path) -> None:
    path = tmp_path / "two.xml"
    side = """<body name="{0}_upper" pos="0 {1} .5"><joint name="{0}_1" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/><body name="{0}_fore" pos=".3 0 0">
<joint name="{0}_2" axis="0 0 1"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03"/>
<site name="{0}_tip" pos=".3 0 0"/></body></body>"""
    path.write_text(
        f"<mujoco><worldbody>{side.format('left', 0.2)}{side.format('right', -0.2)}{CUBE}"
        "</worldbody></mujoco>"
    )
    for name, other in (("left", "right"), ("right", "left")):
        robot = load_robot(path, joints=[f"{name}_*"])
        assert robot.joint_names == (f"{name}_1", f"{name}_2")
        assert robot.tool == f"{name}_tip"
        assert f"{other}_1" in robot.locked_joints
        assert off_after(robot, np.array([0.3, -0.4])) < 1e-5
    assert quiet(path).nv == 4


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"joints": ["j1", "f3x"]}, "joint of r.urdf 'f3x'; did you mean 'f3'"),
        ({"locked": ["jay"]}, "joint of r.urdf 'jay'"),
        ({"joints": ["f2", "f1"]}, "joint 'f2' follows 'f1', which is the one to control"),
        ({"joints": ["j1"], "locked": ["j1"]}, "joint 'j1' cannot be controlled and locked"),
        ({"locked": {"f2": 0.1}}, "'f2' follows 'f1' and cannot be locked alone"),
        ({"locked": {"j1": float("nan")}}, "joint 'j1' cannot be locked at nan"),
        ({"joints": "j1"}, "joints is a collection of names, not the text 'j1'"),
        ({"reference": [0.1]}, "reference posture of r must be 4 finite numbers"),
        ({"reference": {"j9": 0.1}}, "joint of r 'j9'"),
    ],
)
def test_what_cannot_be_is_refused_by_name(
    tmp_path: Path, options: dict[str, object], words: str
) -> None:
    path = arm_with_fingers(tmp_path / "r.urdf", "", '<mimic joint="f1"/>')
    with pytest.raises(osc.OpspaceError, match=words):
        quiet(path, **options)


def test_what_a_motor_cannot_move_alone_is_refused_when_asked_for(tmp_path: Path) -> None:
    scene, _ = HELD["four-bar"]
    path = arm_on_a_table(tmp_path / "a.xml", **scene, around=CUBE + BALL)
    with pytest.raises(ModelError, match="'left_driver' cannot be controlled: a closed loop"):
        load_robot(path, joints=["j1", "left_driver"])
    with pytest.raises(ModelError, match="'swivel' has several coordinates"):
        load_robot(path, locked={"swivel": 0.3})
    circle = arm_with_fingers(tmp_path / "r.urdf", '<mimic joint="f2"/>', '<mimic joint="f1"/>')
    with pytest.raises(ModelError, match="joints f1, f2 follow each other"):
        load_robot(circle)
    with pytest.raises(UnknownNameError, match=r"that 'f2' of r\.urdf mimics, 'ghost'"):
        load_robot(arm_with_fingers(tmp_path / "r.urdf", "", '<mimic joint="ghost"/>'))


def test_a_joint_without_a_motor_can_be_asked_for(tmp_path: Path) -> None:
    """Who says so has a motor there that the file does not know."""
    path = arm_on_a_table(tmp_path / "a.xml", hand=GRIPPER)
    robot = load_robot(path, joints=["j*", "left_driver"])
    assert robot.joint_names == ("j1", "j2", "left_driver")


def test_reference_and_posture_by_name(tmp_path: Path) -> None:
    path = arm_with_fingers(tmp_path / "r.urdf")
    robot = load_robot(path, locked=["f?"], reference={"j2": 0.7})
    np.testing.assert_array_equal(robot.q_reference, [0.0, 0.7])
    np.testing.assert_array_equal(load_robot(path, locked=["f?"], reference=[1, 2]).q, [1.0, 2.0])


def test_a_scenario_says_the_same(tmp_path: Path) -> None:
    path = arm_with_fingers(tmp_path / "r.urdf", "", '<mimic joint="f1"/>')
    said = {"joints": ["j*"], "locked": {"f1": 0.3}, "tool": "g"}
    data = {"robot": str(path), "duration": 0.1, "tasks": {"hold": {"type": "posture", "level": 0}}}
    robot = build_robot(scenario_from(data | said))
    assert robot.joint_names == ("j1", "j2")
    assert robot.tool == "g"
    assert check_robot(robot).locked == {"f1": 0.3, "f2": 0.3, "f3": 0.0}
    for key, wrong in (("joints", ["k*"]), ("locked", {"k": 0.1}), ("tool", "k")):
        with pytest.raises(ScenarioError, match=key):
            build_robot(scenario_from(data | {key: wrong}))


def test_check_names_what_is_held_and_what_follows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = arm_with_fingers(tmp_path / "r.urdf", "", '<mimic joint="f1" multiplier="-2"/>')
    status, printed, _ = run(capsys, "check", str(path), "--lock", "f3=0.5", "--lock", "j1")
    assert status == 0
    assert "held: j1 at 0\nheld: f3 at 0.5\nfollows: f2 = -2 f1\n" in printed
    status, _, error = run(capsys, "check", str(path), "--lock", "f3=half")
    assert (status, error.count("\n")) == (2, 1)
    assert "--lock f3=half: the position is no number" in error
