"""Robots some of whose joints follow others: compiled where no follower moves what a task measures."""

from functools import cache

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController
from opspace.robots.shapes import LinkCapsule
from tests.robots.hands_and_scenes import MOTORS, arm_on_a_table, arm_with_fingers

FINGERS = {
    "gripper": ("", '<mimic joint="f1" multiplier="-1"/>', ""),
    "before": ('<mimic joint="j2" multiplier="0.5" offset="0.1"/>', "", ""),
    "chain": ("", '<mimic joint="f3" multiplier="0.7"/>', ""),
}
EQUAL = '<equality><joint joint1="j2" joint2="j1" polycoef="0.1 0.5 0 0 0"/></equality>'


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("coupled")
    found = {n: arm_with_fingers(folder / f"{n}.urdf", *m) for n, m in FINGERS.items()}
    hand = (
        '<body name="third" pos=".3 0 0"><joint name="j3" axis="0 1 0" range="-90 90"/>'
        '<geom type="capsule" fromto="0 0 0 .2 0 0" size=".02" mass="1"/></body>'
    )
    motors = MOTORS + '<motor joint="j3" ctrlrange="-20 20"/>'
    return {
        **found,
        "elbow": arm_on_a_table(folder / "e.xml", hand=hand, motors=motors, more=EQUAL),
    }


@cache
def loaded(path):
    return osc.load_robot(path)


def pair(path, make, **options):
    kinds = osc.Controller, ReferenceController
    return [kind(loaded(path).fresh(), osc.Stack(make()), **options) for kind in kinds]


def same(a, b):
    np.testing.assert_allclose(a.tau, b.tau, rtol=0, atol=1e-8 * (1.0 + np.abs(b.tau).max()))
    assert a.status == b.status
    assert a.hard_solves == b.hard_solves
    for name, task in b.tasks.items():
        np.testing.assert_allclose(a.tasks[name].error, task.error, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", [*FINGERS, "elbow"])
@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("position", {}),
        ("pose", {"torque_limits": "priority", "period": 1e-3}),
        ("com", {"bias": "task"}),
        ("relative", {}),
        ("orientation", {"period": 1e-3}),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_both_forms_agree_also_for_what_followers_move(files, name, kind, options):
    rng = np.random.default_rng(len(name) + len(kind))
    what = rng.integers(10**6)
    names = loaded(files[name]).frame_names
    frame, other = names[what % len(names)], names[(what // 7) % len(names)]
    make = {
        "position": lambda: osc.PositionTask(frame, target=[0.3, 0.1, 0.4]),
        "pose": lambda: osc.PoseTask(frame),
        "orientation": lambda: osc.OrientationTask(frame, target=np.eye(3)),
        "com": lambda: osc.ComTask(target=[0.1, 0.0, 0.2]),
        "relative": lambda: osc.RelativePositionTask(frame, other),
    }[kind]
    ours, readable = pair(
        files[name], lambda: [osc.JointLimits(), make(), osc.PostureTask()], **options
    )
    robot = ours.robot
    for k in range(3):
        q = robot.q_reference + rng.uniform(-0.5, 0.5, robot.nv)
        v = rng.uniform(-1.0, 1.0, robot.nv)
        same(ours.step(k * 1e-3, q, v), readable.step(k * 1e-3, q, v))


@pytest.mark.parametrize("name", [*FINGERS, "elbow"])
def test_the_tick_is_compiled(files, name):
    ours, _ = pair(files[name], lambda: [osc.JointLimits(), osc.PositionTask(), osc.PostureTask()])
    ours.step(0.0, ours.robot.q_reference, np.zeros(ours.robot.nv))
    assert ours._plan is not None


def test_frames_and_payloads_that_are_added_are_where_they_are(files):
    """Behind a follower and before it; loads count in inertia and weight."""
    commands = []
    for parent in ("hand", "g"):
        for kind in (osc.Controller, ReferenceController):
            robot = osc.load_robot(files["gripper"])
            robot.add_frame("mine", parent=parent, placement=[0.02, 0.03, 0.01])
            robot.payload = osc.Payload(0.4, [0.01, 0.0, 0.02], frame="mine")
            stack = osc.Stack([osc.PositionTask("mine", target=[0.5, 0.1, 0.2]), osc.PostureTask()])
            controller = kind(robot, stack)
            q = robot.q_reference + 0.2
            commands.append(controller.step(0.0, q, np.full(robot.nv, 0.3)))
    same(*commands[:2])
    same(*commands[2:])
    assert not np.allclose(commands[0].tau, commands[2].tau)


def test_distances_take_the_readable_form(files):
    robot = osc.load_robot(files["gripper"])
    hand = LinkCapsule("hand", (0.0, 0.0, 0.0), (0.0, 0.0, 0.05), 0.03)
    guard = osc.CollisionAvoidance(osc.HalfSpace([0.0, 0.0, -3.0]), shapes=[hand])
    controller = osc.Controller(robot, osc.Stack([osc.PostureTask()]), collisions=guard)
    command = controller.step(0.0, robot.q_reference, np.zeros(robot.nv))
    assert controller._plan is None
    assert len(command.distances) == 1
