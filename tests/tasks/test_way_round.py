"""Angles that wrap: whole turns make no difference, and new targets take the short way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.controller import ReferenceController
from opspace.law.scalars import BRANCH_HOLD, SIGNS, without_turns
from opspace.tasks.joint_layout import joint_layout
from opspace.tasks.rotation import exp_rotation
from opspace.tasks.way_round import JointTurns, rotation_jumps

TURN = 2.0 * math.pi
KINDS = pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])

LINK = """<link name="{}"><inertial><origin xyz=".15 0 0"/><mass value="2"/>
<inertia ixx=".02" iyy=".02" izz=".02" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz=".3 0 0"/>
<axis xyz="{}"/><limit {} effort="50" velocity="3"/></joint>"""


def wrist(folder, kinds=("continuous", "revolute", "continuous")):
    """An arm of three joints, some of which turn without end."""
    links = ("base", "a", "b", "c")
    joints = [
        JOINT.format(
            f"j{k + 1}",
            kind,
            links[k],
            links[k + 1],
            ("0 0 1", "0 1 0", "1 0 0")[k],
            "" if kind == "continuous" else 'lower="-2" upper="2"',
        )
        for k, kind in enumerate(kinds)
    ]
    text = f'<robot name="wrist">{"".join(map(LINK.format, links))}{"".join(joints)}</robot>'
    path = folder / "wrist.urdf"
    path.write_text(text)
    return path


def wrapped(q):
    return (np.asarray(q) + math.pi) % TURN - math.pi


# --- the scalar law ----------------------------------------------------------------------------------


@given(st.floats(-40.0, 40.0), st.booleans(), st.booleans())
def test_an_error_without_turns_is_the_same_angle(error, known, negative):
    found = without_turns(error, known, negative)
    assert math.remainder(found - error, TURN) == pytest.approx(0.0, abs=1e-12)
    assert abs(found) <= math.pi + BRANCH_HOLD + 1e-12
    if not known:
        assert abs(found) <= math.pi + 1e-12
    if abs(error) <= math.pi and (not known or negative == (error < 0.0)):
        assert found == error  # to the last bit: most joints never come that far


@given(st.floats(-3.0, 3.0), st.integers(-3, 3), st.sampled_from([-1.0, 1.0]))
def test_a_growing_error_goes_on_past_half_a_turn(offset, turns, sign):
    errors = JointTurns()
    endless = np.array([True, False])
    for angle in sign * np.arange(0.1, math.pi + BRANCH_HOLD, 0.05):
        found = errors(np.array([angle + turns * TURN, angle + offset]), endless)
        np.testing.assert_allclose(found, [angle, angle + offset], atol=1e-12)
    back = errors(np.array([sign * (math.pi + BRANCH_HOLD + 0.05), 0.0]), endless)
    assert back[0] == pytest.approx(sign * (BRANCH_HOLD + 0.05 - math.pi))


def test_signs_of_many_joints_are_kept_apart():
    rows = 3 * SIGNS + 5
    errors, endless = JointTurns(), np.ones(rows, bool)
    rng = np.random.default_rng(3)
    sign = rng.choice([-1.0, 1.0], rows)
    errors(sign * (math.pi - 0.1), endless)
    np.testing.assert_allclose(errors(sign * (math.pi + 0.1), endless), sign * (math.pi + 0.1))


@given(st.floats(0.0, math.pi))
def test_a_rotation_jumps_by_its_angle(angle):
    R = exp_rotation(np.array([0.4, -0.2, 0.7]))
    turned = exp_rotation(angle * np.array([0.0, 0.6, 0.8])) @ R
    if abs(angle - 0.05) > 1e-6:
        assert rotation_jumps(R, turned) == (angle > 0.05)


# --- which joints ------------------------------------------------------------------------------------


def test_joints_that_turn_without_end_are_found(tmp_path):
    text = """<mujoco><compiler angle="radian"/><worldbody><body name="cart">
      <joint name="rail" type="slide" axis="1 0 0"/><geom size="0.1" mass="2"/>
      <body pos="0 0 0.2"><joint name="free" axis="0 0 1"/><geom size="0.1" mass="1"/>
      <body pos="0 0 0.2"><joint name="kept" axis="0 1 0" range="-2 2"/><geom size="0.1" mass="1"/>
      <body pos="0 0 0.2"><joint name="last" axis="1 0 0"/><geom size="0.1" pos="0 0.1 0" mass="1"/>
      </body></body></body></body></worldbody><actuator><motor joint="rail"/><motor joint="free"/>
      <motor joint="kept"/><motor joint="last"/></actuator></mujoco>"""
    path = tmp_path / "cart.xml"
    path.write_text(text)
    robot = osc.load_robot(path)
    q = robot.q.copy()
    assert joint_layout(robot, None).endless.tolist() == [False, True, False, True]
    assert joint_layout(robot, ["last", "rail"]).endless.tolist() == [True, False]
    np.testing.assert_array_equal(robot.q, q)


@pytest.mark.parametrize("backend", ["pinocchio", "mujoco"])
def test_continuous_joints_of_a_urdf_turn_without_end(tmp_path, backend):
    robot = osc.load_robot(wrist(tmp_path), backend=backend)
    assert joint_layout(robot, None).endless.tolist() == [True, False, True]
    assert not joint_layout(osc.load_robot("puma560"), None).endless.any()


# --- the controller ----------------------------------------------------------------------------------


def stacks(path):
    """Every task on joints, with constant targets beyond π and with one that winds up."""
    winding = osc.MinimumJerk([0.0], [3.5 * TURN], 2.0)
    return {
        "posture": [osc.PostureTask([0.2, 0.3, -0.1])],
        "held": [osc.PostureTask()],
        "beyond": [osc.PostureTask([4.0, 0.3, -9.0], max_speed=0.5)],
        "joint": [osc.JointTask("j3", 5.0), osc.PostureTask()],
        "winding": [osc.JointTask("j1", winding), osc.PostureTask()],
        "some": [osc.PostureTask([2.0, 7.0], joints=["j3", "j1"], name="two"), osc.PostureTask()],
    }


@KINDS
@pytest.mark.parametrize("which", ["posture", "held", "beyond", "joint", "winding", "some"])
def test_an_encoder_that_wraps_makes_no_difference(tmp_path, kind, which):
    """The joints run through π in both directions; the target may be on either side."""
    path, taus = wrist(tmp_path), []
    for measured in (lambda q: q, wrapped):
        robot = osc.load_robot(path)
        controller = kind(robot, osc.Stack([osc.JointLimits(), *stacks(path)[which]]))
        found = []
        for k in range(200):
            t = 1e-3 * k
            q, v = np.array([3.0 + 1.5 * t, 0.4, -3.0 - 1.2 * t]), np.array([1.5, 0.0, -1.2])
            found.append(controller.step(t, measured(q), v).tau)
        taus.append(np.array(found))
    np.testing.assert_allclose(taus[0], taus[1], atol=1e-9 * np.abs(taus[0]).max())
    assert np.abs(np.diff(taus[1], axis=0)).max() < 0.5


@KINDS
def test_a_target_half_a_turn_away_is_not_given_up_by_noise(tmp_path, kind):
    robot = osc.load_robot(wrist(tmp_path))
    turn = osc.JointTask("j1", math.pi)
    controller = kind(robot, osc.Stack([turn, osc.PostureTask()]))
    rng = np.random.default_rng(2)
    errors = [
        controller.step(1e-3 * k, rng.normal(0.0, 1e-4, 3), np.zeros(3)).tasks["j1"].error[0]
        for k in range(40)
    ]
    assert np.ptp(errors) < 1e-2
    turn.target = -2.9  # given anew: the short way, in the other direction
    error = controller.step(0.05, np.zeros(3), np.zeros(3)).tasks["j1"].error[0]
    assert error == pytest.approx(-2.9)


@pytest.mark.parametrize(("off", "on"), [(0.2, 0.6), (3.0, 3.4), (-1.0, -2.5), (7.0, 6.5)])
def test_a_buffer_of_a_joint_without_end_closes_the_circle(tmp_path, off, on):
    robot = osc.load_robot(wrist(tmp_path))
    buffer, plain = osc.JointBuffer("j3", off, on), osc.JointBuffer("j2", off, on)
    for one in (buffer, plain):
        one.bind(robot)

    def at(joint, position):
        q = np.zeros(3)
        q[joint] = position
        robot.update(q, np.zeros(3))
        return (buffer if joint == 2 else plain)(robot, 0.0)

    around = [at(2, position) for position in np.linspace(-9.0, 9.0, 3001)]
    assert np.abs(np.diff(around)).max() < 0.05
    assert np.mean(around) == pytest.approx(0.5, abs=0.1)
    for position in np.linspace(0.5 * (off + on) - 1.5, 0.5 * (off + on) + 1.5, 20):
        assert at(2, position) == pytest.approx(at(1, position), abs=1e-12)
        assert at(2, wrapped(position)) == pytest.approx(at(2, position), abs=1e-12)
    assert at(2, on) == 1.0
    assert at(2, off) == 0.0


def test_a_buffer_of_half_a_turn_has_no_place_on_a_circle(tmp_path):
    robot = osc.load_robot(wrist(tmp_path))
    with pytest.raises(osc.InputError, match=r"'j1' turns without end.*half a turn"):
        osc.JointBuffer("j1", -2.0, 2.0).bind(robot)
    osc.JointBuffer("j2", -2.0, 2.0).bind(robot)


# --- new targets of rotations ------------------------------------------------------------------------


def error_of(controller, t, axis, name="orientation"):
    robot = controller.robot
    command = controller.step(t, robot.q_reference, np.zeros(robot.nv))
    return float(command.tasks[name].error[-3:] @ axis)


def turned(robot, angle, axis):
    robot.update(robot.q_reference, np.zeros(robot.nv))
    return exp_rotation(angle * axis) @ robot.rotation(robot.frame_id(robot.tool))


def samples(goals):
    """A reference that gives one orientation after the other, one per millisecond."""
    return lambda t: osc.Sample(goals[round(t / 1e-3)], np.zeros(3), np.zeros(3))


AXES = [np.array(axis) / np.linalg.norm(axis) for axis in ([0, 0, 1], [1, -2, 0], [0.3, 0.4, -1])]


@KINDS
@pytest.mark.parametrize("axis", AXES, ids=str)
@pytest.mark.parametrize(("first", "second"), [(100, -100), (-150, 120), (179, -170), (95, 230)])
def test_a_new_target_takes_the_short_way(kind, axis, first, second):
    robot = osc.load_robot("puma560")
    task = osc.OrientationTask()
    controller = kind(robot, osc.Stack([task, osc.PostureTask()]))
    for k, degrees in enumerate((first, second)):
        task.target = turned(robot, math.radians(degrees), axis)
        short = math.remainder(math.radians(degrees), TURN)
        assert error_of(controller, 1e-3 * k, axis) == pytest.approx(short, abs=1e-9)


@KINDS
def test_a_pose_takes_the_short_way_too_whatever_gives_the_target(kind):
    robot, axis = osc.load_robot("puma560"), AXES[1]
    task = osc.PoseTask(name="orientation")
    controller = kind(robot, osc.Stack([task, osc.PostureTask()]))
    here = robot.position(robot.frame_id(robot.tool)).copy()
    goals = [turned(robot, math.radians(d), axis) for d in (100, -100, 110, -120)]
    targets = [
        (here, goals[0]),
        osc.PoseReference(osc.Constant(here), goals[1]),
        osc.Constant((here, goals[2])),
        osc.PoseReference(here, goals[3]),
    ]
    for k, (target, degrees) in enumerate(zip(targets, (100, -100, 110, -120), strict=True)):
        task.target = target
        assert error_of(controller, 1e-3 * k, axis) == pytest.approx(math.radians(degrees))


@KINDS
def test_one_continuous_reference_keeps_its_way(kind):
    """Past half a turn in small steps, by a reference and by values that are streamed."""
    robot, axis = osc.load_robot("puma560"), AXES[2]
    angles = np.linspace(3.0, 3.6, 31)
    for stream in (False, True):
        task = osc.OrientationTask()
        controller = kind(robot, osc.Stack([task, osc.PostureTask()]))
        goals = [turned(robot, a, axis) for a in angles]
        if not stream:
            task.target = samples(goals)
        for k, angle in enumerate(angles):
            if stream:
                task.target = goals[k]
            assert error_of(controller, 1e-3 * k, axis) == pytest.approx(angle, abs=1e-9)


def test_the_way_survives_changes_of_the_stack_but_not_of_the_target():
    """Plans come and go, and the readable form takes over for more tasks than are compiled."""
    robot, axis = osc.load_robot("puma560"), AXES[0]
    task = osc.OrientationTask()
    controller = osc.Controller(robot, osc.Stack([task, osc.PostureTask()]))
    crowd = [osc.JointTask("joint1", name=f"guest {k}", kp=0.0, kv=0.0) for k in range(40)]
    t, angle = 0.0, 3.0

    def tick(step):
        nonlocal t, angle
        t, angle = t + 1e-3, angle + step
        task.target = turned(robot, angle, axis)
        return error_of(controller, t, axis)

    for _ in range(10):
        assert tick(0.03) == pytest.approx(angle, abs=1e-9)
    for change in ("one", "many", "few"):
        if change == "one":
            controller.stack.insert(crowd[0], 3.0, 0.002)
        elif change == "many":
            for guest in crowd[1:]:
                controller.stack.insert(guest, 3.0, 0.0)
        else:
            for guest in crowd[1:]:
                controller.stack.remove(guest, 0.0)
        for _ in range(4):
            assert tick(0.02) == pytest.approx(angle, abs=1e-9)
    assert angle > math.pi
    controller.stack.remove(crowd[0], 0.0)
    angle += 0.2  # a jump in the very tick in which the stack changes
    assert tick(0.0) == pytest.approx(angle - TURN, abs=1e-9)
