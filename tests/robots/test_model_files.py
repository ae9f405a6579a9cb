"""Model files in the style of real ones: every warning that a person needs, none that misleads, and an
arm that holds still, or a refusal by name."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import opspace as osc
from opspace import ModelWarning, OpspaceError, load_robot
from opspace.robots.adapter import AdapterBase
from opspace.robots.catalogue import CATALOGUE, SHIPPED, locate
from opspace.runs.check import check_robot
from tests.cli.test_cli import run
from tests.robots.hands_and_scenes import (
    GRIPPER,
    MOTORS,
    arm_on_a_table,
    arm_with_fingers,
    joint,
    link,
)

TENDON = (
    '<tendon><fixed name="split"><joint joint="left_driver" coef=".5"/>'
    '<joint joint="right_driver" coef=".5"/></fixed></tendon>'
)
GRIP = MOTORS + '<motor name="grip" tendon="split" ctrlrange="-5 5"/>'
CUBE = (
    '<body name="cube" pos=".9 0 -.455"><freejoint/><geom type="box" size=".02 .02 .02" '
    'contype="1" conaffinity="1"/></body><geom name="top" type="box" size="1 1 .02" pos="0 0 -.5" '
    'contype="1" conaffinity="1"/>'
)
SECOND = (
    '<body name="right_upper" pos="0 1 .5"><joint name="right_1" axis="0 1 0" range="-120 120"/>'
    '<geom type="capsule" fromto="0 0 0 .4 0 0" size=".04" mass="3"/><body name="right_fore" '
    'pos=".4 0 0"><joint name="right_2" axis="0 1 0" range="-120 120"/><geom type="capsule" '
    'fromto="0 0 0 .3 0 0" size=".03" mass="2"/></body></body>'
)
BOTH = MOTORS + '<motor joint="right_1"/><motor joint="right_2"/>'
FINGER = (
    '<body name="proximal" pos=".3 0 0"><joint name="knuckle" axis="0 1 0" range="0 90"/>'
    '<geom type="capsule" fromto="0 0 0 .05 0 0" size=".01" mass=".05"/><body name="distal" '
    'pos=".05 0 0"><joint name="tip_joint" axis="0 1 0" range="0 90"/><geom type="capsule" '
    'fromto="0 0 0 .03 0 0" size=".01" mass=".03"/></body></body>'
)
PULLED = (
    '<tendon><fixed name="flexor"><joint joint="knuckle" coef="1"/><joint joint="tip_joint" '
    'coef=".6"/></fixed></tendon>'
)
SERVOS = (
    '<position name="p1" joint="j1" kp="500" forcerange="-90 90"/>'
    '<position name="p2" joint="j2" kp="500" forcerange="-50 50"/>'
)


@dataclass(frozen=True)
class Case:
    """A file: how it is written and loaded, what is said of it, and what refuses it."""

    write: Callable[[Path], Path]
    said: tuple[str, ...] = ()
    refused: str = ""
    options: dict[str, Any] = field(default_factory=dict)


def scene(**parts: str) -> Callable[[Path], Path]:
    return lambda folder: arm_on_a_table(folder / "scene.xml", **parts)


def edited(old: str, new: str, **parts: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = arm_on_a_table(folder / "edited.xml", **parts)
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))
        return path

    return write


def urdf(*parts: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = folder / "robot.urdf"
        path.write_text('<robot name="r">' + "".join(parts) + "</robot>")
        return path

    return write


def fingers(*mimics: str) -> Callable[[Path], Path]:
    return lambda folder: arm_with_fingers(folder / "fingers.urdf", *mimics)


ARM = (
    *map(link, ("base", "a", "b", "c")),
    joint("j1", "base", "a"),
    joint("j2", "a", "b", axis="1 0 0"),
)
LIFT = joint("lift", "base", "a", kind="prismatic", axis="0 0 1")
BASE = '<joint name="{}" type="slide" axis="{}" range="-5 5"/>'

CASES = {
    "gripper with mimic": Case(fingers("", '<mimic joint="f1" multiplier="-1"/>')),
    "mimic of a fixed joint": Case(
        fingers("", '<mimic joint="flange" offset=".1"/>'), ("a fixed joint leads f2: held fixed",)
    ),
    "four-bar": Case(
        scene(
            hand=GRIPPER,
            motors=GRIP,
            more=TENDON
            + '<equality><connect body1="left_pad" body2="right" anchor="0 0 0"/></equality>',
        ),
        ("a closed loop (connect or weld) binds left_driver, left_tip, right_driver: held fixed",),
    ),
    "gripper on a split tendon": Case(
        scene(hand=GRIPPER, motors=GRIP, more=TENDON),
        ("no motor drives left_tip: held", "a tendon drives, together with others, left_driver"),
    ),
    "gripper with an equality": Case(
        scene(
            hand=GRIPPER,
            motors=MOTORS + '<motor joint="left_driver"/>',
            more='<equality><joint joint1="right_driver" joint2="left_driver"/></equality>',
        ),
        ("no motor drives left_tip: held fixed",),
    ),
    "arm on a table with a cube": Case(
        scene(around=CUBE), ("nothing but contact moves cube: held fixed",)
    ),
    "two arms": Case(scene(around=SECOND, motors=BOTH)),
    "one of two arms": Case(
        scene(around=SECOND, motors=BOTH), options={"joints": ["right_*"], "tool": "right_fore"}
    ),
    "linear axis": Case(urdf(*ARM[:4], LIFT, joint("j2", "a", "b"), joint("j3", "b", "c"))),
    "continuous wrist": Case(
        urdf(*ARM, joint("wrist", "b", "c", kind="continuous", axis="0 0 1"))
    ),
    "tendon finger": Case(
        scene(hand=FINGER, more=PULLED, motors=MOTORS + '<motor tendon="flexor"/>'),
        ("a tendon drives, together with others, knuckle, tip_joint: held fixed",),
    ),
    "site named like a body": Case(
        edited('site name="wrist"', 'site name="fore"'),
        ("a body and a site are called 'fore': the frame 'fore' is the body, 'site:fore' the",),
    ),
    "gravcomp": Case(edited('<body name="fore"', '<body name="fore" gravcomp="1"')),
    "position actuators": Case(
        scene(motors=SERVOS), ("actuators p1, p2 pull by themselves (position or velocity servos)",)
    ),
    "velocity servos": Case(
        scene(motors='<velocity joint="j1" kv="9"/><velocity joint="j2" kv="9"/>'),
        ("actuators actuator0, actuator1 pull by themselves",),
    ),
    "spring that balances": Case(edited('axis="0 1 0" range', 'axis="0 1 0" stiffness="30" range')),
    "base that nobody drives": Case(
        edited(
            '<body name="upper" euler="10 0 0">',
            '<body name="cart">' + BASE.format("x", "1 0 0") + BASE.format("y", "0 1 0")
            + '<geom size=".1"/></body><body name="upper" euler="10 0 0">',
        ),
        ("no motor drives x, y: held fixed",),
    ),
    "no limits": Case(
        urdf(*ARM[:4], *(j.replace('lower="-2" upper="2" effort="60" velocity="3"', "")
                         for j in (joint("j1", "base", "a"), joint("j2", "a", "b"),
                                   joint("j3", "b", "c")))),
        ("the lower and the upper limit of j1, j2, j3 are both 0: taken as no limit",),
    ),
    "effort of -1": Case(urdf(*ARM[:5], *(
        joint(n, p, c).replace('effort="60"', 'effort="-1"') for n, p, c in
        (("j2", "a", "b"), ("j3", "b", "c"))))),
    "weaker one way": Case(
        scene(motors='<motor joint="j1" ctrlrange="-90 60"/><motor joint="j2" ctrlrange="-50 50"/>'),
    ),
    "only pulls": Case(
        scene(motors='<motor joint="j1" ctrlrange="0 90"/><motor joint="j2"/>'),
        refused="motors without torque in one direction or both: j1",
    ),
    "ball joint with a motor": Case(
        scene(hand='<body name="w" pos=".3 0 0"><joint name="swivel" type="ball"/>'
              '<geom size=".03"/></body>', motors=MOTORS + '<motor joint="swivel"/>'),
        refused="joints with several coordinates",
    ),
    "loop in a URDF": Case(
        urdf(*ARM, joint("j3", "b", "c"), joint("j4", "base", "c")),
        refused="the joints do not connect the links to one tree",
    ),
    "joint without range": Case(
        urdf(*ARM, joint("j3", "b", "c").replace('lower="-2" upper="2"', 'lower="1" upper="1"')),
        refused="lower and upper limit of joint 'j3' are both 1: it cannot move",
    ),
}  # fmt: skip


def off_after(robot: AdapterBase, seconds: float = 2.0) -> float:
    """Hold the reference posture in the simulator and return how far the tool went, m."""
    plant = osc.Plant(robot, robot.q_reference)
    start = robot.position(robot.tool).copy()
    stack = osc.Stack([osc.JointLimits(), osc.PositionTask(), osc.PostureTask(kp=25.0)])
    osc.simulate(plant, osc.Controller(robot, stack), seconds)
    robot.update(plant.q, plant.v)
    return float(np.abs(robot.position(robot.tool) - start).max())


@pytest.mark.filterwarnings("ignore::opspace.ModelWarning")
@pytest.mark.parametrize("what", CASES)
def test_a_file_is_checked_held_still_or_refused(
    tmp_path: Path, what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    case = CASES[what]
    path = case.write(tmp_path)
    if case.refused:
        with pytest.raises(OpspaceError) as refused:
            osc.Controller(load_robot(path, **case.options), osc.Stack([osc.PostureTask()]))
        assert case.refused in str(refused.value)
        return
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ModelWarning)
        robot = load_robot(path, **case.options)
    said = [str(w.message) for w in caught]
    assert len(said) == len(case.said), said
    for sentence in case.said:
        assert any(sentence in text for text in said), said
    words = [w for name in case.options.get("joints", ()) for w in ("--joints", name)]
    status, printed, _ = run(capsys, "check", str(path), *words)
    assert status == 0
    flat = " ".join(printed.split())
    for sentence in case.said:
        assert sentence in flat, printed
    assert off_after(robot) < 1e-3


WHEELS = (*ARM, joint("j3", "b", "c"), link("wheel"), link("caster"),
          joint("drive", "base", "wheel", kind="continuous"),
          joint("roll", "base", "caster", kind="continuous", axis="0 0 1"))  # fmt: skip


@pytest.mark.filterwarnings("ignore::opspace.ModelWarning")
@pytest.mark.parametrize(
    ("write", "beside"),
    [
        (urdf(*WHEELS), ("drive", "roll")),
        (urdf(*ARM, joint("j3", "b", "c")), ()),
        (CASES["gripper with an equality"].write, ("left_driver",)),
        (scene(around=SECOND, motors=BOTH), ("right_1", "right_2")),
    ],
    ids=["wheels", "arm", "gripper", "two arms"],
)
def test_joints_that_do_not_move_the_tool_are_named(
    tmp_path: Path, write: Callable[[Path], Path], beside: tuple[str, ...],
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    path = write(tmp_path)
    report = check_robot(load_robot(path))
    assert report.beside == beside
    _, printed, _ = run(capsys, "check", str(path))
    assert ("not on the way to the tool: " + ", ".join(beside) in printed) == bool(beside)
    # Fingers that go a few centimetres are always within a tenth of a metre of their ends.
    assert not any("of a limit" in sentence for sentence in report.warnings)
    assert "e-1" not in printed


@pytest.mark.filterwarnings("ignore::opspace.ModelWarning")
@pytest.mark.parametrize(
    "what",
    ["two arms", "gravcomp", "position actuators", "velocity servos", "spring that balances",
     "site named like a body", "weaker one way", "arm on a table with a cube"],
)  # fmt: skip
def test_the_whole_file_holds_still_in_a_loop_of_ones_own(tmp_path: Path, what: str) -> None:
    """As docs/how-to say: actuation off, torques by name, the rest of the scene as it is."""
    path = CASES[what].write(tmp_path)
    robot = load_robot(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    model.opt.timestep = 0.001
    data = mujoco.MjData(model)
    places = [int(model.joint(name).qposadr[0]) for name in robot.joint_names]
    dofs = [int(model.joint(name).dofadr[0]) for name in robot.joint_names]
    data.qpos[places] = robot.q_reference
    start = robot.position(robot.tool).copy()
    controller = osc.Controller(robot, osc.Stack([osc.PostureTask(robot.q_reference)]))
    for _ in range(2000):
        tau = controller.step(data.time, data.qpos[places], data.qvel[dofs]).tau
        data.qfrc_applied[dofs] = tau
        mujoco.mj_step(model, data)
    robot.update(data.qpos[places], data.qvel[dofs])
    assert np.abs(robot.position(robot.tool) - start).max() < 1e-3


def files_of_others() -> list[Path]:
    """Give every robot of example-robot-data, arms, humanoids and the rest."""
    entry = next((e for e in CATALOGUE.values() if e.package != SHIPPED and locate(e)), None)
    if entry is None:
        return []
    path = locate(entry)
    assert path is not None
    root = next(folder for folder in path.parents if folder.name == "example-robot-data")
    return sorted(root.rglob("*.urdf"))


REFUSED = {
    "alex_psyonic_hands",  # a joint mimics one that is not there
    "quadrotor_base",  # nothing moves
    "iris_simple",
    "pr2",  # a joint follows another one that may only go where it may not
    "romeo",  # hands of links without mass
    "romeo_laas_small",
    "icub",  # three axes of a neck about one point of mass
    "ur3",  # no link at all
}
"""Files of which nothing can be made as they are."""


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::opspace.ModelWarning")
@pytest.mark.parametrize("path", files_of_others(), ids=lambda path: path.stem)
def test_every_robot_of_example_robot_data(path: Path) -> None:
    """It is checked and held still, or what is wrong with its file is said by name."""
    try:
        robot = load_robot(path)
        report = check_robot(robot)
    except OpspaceError as refused:
        words = str(refused)
        assert path.name in words or "moves no mass of its own" in words
        assert path.stem in REFUSED, words
        return
    assert path.stem not in REFUSED
    plant = osc.Plant(robot, robot.q_reference)
    robot.update(robot.q_reference, np.zeros(robot.nv))
    start = robot.position(robot.tool).copy()
    controller = osc.Controller(robot, osc.Stack([osc.PostureTask(robot.q_reference)]))
    osc.simulate(plant, controller, 2.0)
    weak = any("torque is above the limit" in sentence for sentence in report.warnings)
    robot.update(plant.q, plant.v)
    assert weak or np.abs(robot.position(robot.tool) - start).max() < 1e-3
