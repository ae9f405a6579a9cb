"""Frames that are added to a robot are what the same frames in its file are."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import mujoco
import numpy as np
import pytest

import opspace as osc
from opspace import InputError, UnknownNameError, load_robot
from opspace.controller.reference import ReferenceController
from opspace.robots.adapter import AdapterBase
from opspace.view.page import _robot as robot_of_recording
from tests.robots.hands_and_scenes import GRIPPER, MOTORS, arm_on_a_table
from tests.robots.samples import BACKENDS, MJCF, random_state

PLACE = np.array([0.1, -0.05, 0.2, 0.5, -0.5, 0.5, 0.5])
QUESTIONS = ("position", "rotation", "jacobian", "velocity", "drift")


def as_matrix(place: np.ndarray) -> np.ndarray:
    T, R = np.eye(4), np.empty(9)
    mujoco.mju_quat2Mat(R, place[3:])
    T[:3, :3], T[:3, 3] = R.reshape(3, 3), place[:3]
    return T


def with_site(xml: str, body: str) -> str:
    """Write the frame into a file as a site of a body."""
    at, turned = " ".join(map(str, PLACE[:3])), " ".join(map(str, PLACE[3:]))
    start = xml.index(f'<body name="{body}"')
    end = xml.index(">", start) + 1
    return xml[:end] + f'<site name="own" pos="{at}" quat="{turned}"/>' + xml[end:]


def robots(folder: Path, backend: str) -> dict[str, tuple[AdapterBase, AdapterBase, str]]:
    """Give robots, the same with the frame in their file, and what it hangs on."""
    found = {}
    lead = '<equality><joint joint1="left_driver" joint2="right_driver"/></equality>'
    motors = MOTORS + '<motor joint="right_driver"/>'
    arm_on_a_table(folder / "arm.xml", hand=GRIPPER, more=lead, motors=motors)
    (folder / "medley.xml").write_text(MJCF)
    for name, body in (("arm", "fore"), ("arm", "right"), ("medley", "hand"), ("arm", "table")):
        path, own = folder / f"{name}.xml", folder / f"{name}_{body}.xml"
        own.write_text(with_site(path.read_text(), body))
        pair = [load_robot(p, backend=backend, locked=[]) for p in (path, own)]
        found[f"{name} {body}"] = (*pair, body)
    return found


@pytest.mark.filterwarnings("ignore::opspace.ModelWarning")
@pytest.mark.parametrize("backend", BACKENDS)
def test_an_added_frame_is_one_of_the_file(tmp_path: Path, backend: str) -> None:
    rng = np.random.default_rng(3)
    for robot, other, body in robots(tmp_path, backend).values():
        for form, place in (("seven", PLACE), ("matrix", as_matrix(PLACE))):
            robot.add_frame(form, body, place)
        half = as_matrix(np.array([*PLACE[:3] / 2.0, 1.0, 0.0, 0.0, 0.0]))
        robot.add_frame("half", body, half)
        robot.add_frame("chain", "half", np.linalg.inv(half) @ as_matrix(PLACE))
        for _ in range(2):
            state = random_state(robot, rng)
            robot.update(*state)
            other.update(*state)
            for name in ("seven", "matrix", "chain"):
                assert robot.frame_id(name) == robot.frame_names.index(name)
                for question in QUESTIONS:
                    np.testing.assert_allclose(
                        getattr(robot, question)(name),
                        getattr(other, question)("own"),
                        atol=1e-11,
                        err_msg=f"{body} {name} {question}",
                    )


@pytest.mark.parametrize("backend", BACKENDS)
def test_tasks_follow_it_compiled_and_readable(backend: str) -> None:
    robot, file = (load_robot("puma560", backend=backend) for _ in range(2))
    tasks = [osc.PoseTask("tcp"), osc.PostureTask()]
    frame = robot.add_frame("tcp", placement=PLACE)
    robot.tool = "tcp"
    fast, slow = (kind(robot, osc.Stack(tasks)) for kind in (osc.Controller, ReferenceController))
    q, v = robot.q_reference + 0.1, np.linspace(-0.3, 0.4, robot.nv)
    command = fast.step(0.0, q, v)
    np.testing.assert_allclose(command.tau, slow.step(0.0, q, v).tau, atol=1e-9)
    assert robot.motion_axes().frames[frame].joint == robot.nv - 1
    # One that is added when the controller has ticked already.
    robot.add_frame("later", "tcp", [0.0, 0.0, 0.1])
    later = osc.RelativePositionTask("later", "base" if "base" in file.frame_names else "world")
    fast.stack.insert(later, level=0, duration=0.0)
    taus = [
        fast.step(0.002, q, v).tau,
        ReferenceController(robot, fast.stack).step(0.003, q, v).tau,
    ]
    np.testing.assert_allclose(*taus, atol=1e-9)
    # Copies have it.
    for copied in (robot.fresh(), copy.deepcopy(robot), pickle.loads(pickle.dumps(robot))):
        assert copied.tool == "tcp"
        copied.update(q, v)
        robot.update(q, v)
        np.testing.assert_array_equal(copied.position("later"), robot.position("later"))


def test_a_recording_knows_it(tmp_path: Path) -> None:
    robot = load_robot("puma560")
    robot.add_frame("tcp", placement=PLACE)
    robot.add_frame("tip", "tcp", [0.0, 0.0, 0.1])
    robot.tool = "tip"
    controller = osc.Controller(robot, osc.Stack([osc.PositionTask("tcp"), osc.PostureTask()]))
    recorder = osc.TickRecorder(tmp_path / "run", controller, {})
    q, v = robot.q_reference, np.zeros(6)
    recorder.observe(q, v, controller.step(0.0, q, v))
    recorder.close()
    about = osc.load(tmp_path / "run").header["robot"]
    shown = robot_of_recording(about)
    assert shown.tool == "tip"
    robot.update(q, v)
    shown.update(q, v)
    for name in ("tcp", "tip"):
        np.testing.assert_allclose(shown.position(name), robot.position(name), atol=1e-12)
    assert osc.load(tmp_path / "run").header["tasks"]["position"]["frame"] == "tcp"


def test_what_cannot_be_added_is_refused() -> None:
    robot = load_robot("puma560")
    robot.add_frame("tcp", "tool", [0.0, 0.0, 0.1])
    for name in ("tcp", "tool"):
        with pytest.raises(InputError, match=f"has a frame '{name}' already"):
            robot.add_frame(name)
    with pytest.raises(InputError, match="a frame needs a name"):
        robot.add_frame("")
    with pytest.raises(UnknownNameError, match="frame of puma560 'tpc'; did you mean 'tcp'"):
        robot.add_frame("own", "tpc")
    mirrored = np.diag([1.0, 1.0, -1.0, 1.0])
    wrong = ([0.1, 0.2], "up", [np.nan] * 3, mirrored, [0, 0, 0, 2, 0, 0, 0], 2.0 * np.eye(4))
    for place in wrong:
        with pytest.raises(InputError, match="placement of frame 'own'"):
            robot.add_frame("own", placement=place)
    assert "own" not in robot.frame_names
