"""References begin when they are followed, at the time that they were given, or go on in a chain."""

from __future__ import annotations

import numpy as np
import pytest

import opspace as osc
from opspace.controller import ReferenceController
from opspace.tasks.references.start import begun
from opspace.tasks.rotation import exp_rotation, quaternion_from_matrix

KINDS = pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
CLOCKS = pytest.mark.parametrize("clock", [0.0, 5.0, -3.0, 1.7e9])
DT = 1e-3
R0 = exp_rotation(np.array([0.2, -0.1, 0.3]))
A, B = np.array([0.1, 0.2, 0.3]), np.array([0.3, 0.1, 0.4])
LIMITS = {"max_velocity": 0.5, "max_acceleration": 2.0, "max_jerk": 20.0}

MOTIONS = {
    "minimum jerk": lambda **s: osc.MinimumJerk(A, B, 1.0, **s),
    "jerk limited": lambda **s: osc.JerkLimited(A, B, **LIMITS, **s),
    "circle": lambda **s: osc.Circle(A, 0.1, 1.0, **s),
    "via points": lambda **s: osc.ViaPoints([0.0, 0.5, 1.0], [A, B, A], **s),
    "chain": lambda **s: osc.Chain(
        (0.0, osc.MinimumJerk(A, B, 0.5)), (0.7, osc.MinimumJerk(B, A, 0.5)), **s
    ),
    "turn": lambda **s: osc.OrientationMinimumJerk(np.eye(3), R0, 1.0, **s),
    "turn with limits": lambda **s: osc.OrientationJerkLimited(np.eye(3), R0, **LIMITS, **s),
}
EVERY = pytest.mark.parametrize("make", list(MOTIONS.values()), ids=list(MOTIONS))


def assert_same(one, two, **tolerance):
    for a, b in zip(one, two, strict=True):
        np.testing.assert_allclose(a, b, **tolerance)


@EVERY
def test_a_reference_without_a_start_is_a_function_of_the_time_since_its_beginning(make):
    free, at_zero = make(), make(start_time=0.0)
    later = begun(free, 2.5)
    for t in (-0.2, 0.0, 0.3, 0.6, 0.9, 2.0):
        assert_same(free(t), at_zero(t), atol=0.0)
        assert_same(later(2.5 + t), free(t), atol=1e-9)
    assert begun(at_zero, 2.5) is at_zero  # has a time of its own
    assert free.start_time is None


@EVERY
def test_a_start_time_that_is_none_is_refused(make):
    with pytest.raises(osc.InputError, match="start_time"):
        make(start_time="soon")
    with pytest.raises(osc.InputError, match="start_time"):
        make(start_time=np.nan)


def test_a_chain_starts_its_pieces_and_leaves_those_that_have_a_time_alone():
    pieces = [(0.0, osc.MinimumJerk(A, B, 1.0)), (2.0, osc.MinimumJerk(B, A, 1.0))]
    own = [(t, osc.MinimumJerk(p.start, p.goal, 1.0, start_time=t)) for t, p in pieces]
    inner = osc.Chain((0.0, osc.Constant(A)), (0.5, osc.MinimumJerk(A, B, 0.3)))
    nested = osc.Chain((0.0, osc.Constant(A)), (1.0, inner))
    for t in np.linspace(-0.5, 3.5, 30):
        assert_same(osc.Chain(*pieces)(t), osc.Chain(*own)(t), atol=1e-12)
        assert_same(nested(t + 1.0), inner(t), atol=1e-12)


def test_a_pose_begins_with_its_parts():
    moving = osc.MinimumJerk(A, B, 1.0)
    turning = osc.OrientationMinimumJerk(np.eye(3), R0, 1.0, start_time=7.0)
    pose = begun(osc.PoseReference(moving, turning), 6.0)
    x = pose(7.5).x
    np.testing.assert_allclose(x[:3, 3], B)
    np.testing.assert_allclose(x[:3, :3], turning(7.5).x, atol=1e-12)


# --- with a controller -------------------------------------------------------------------------------


def arm():
    robot = osc.load_robot("puma560")
    robot.update(robot.q_reference, np.zeros(6))
    frame = robot.frame_id(robot.tool)
    return robot, robot.position(frame).copy(), robot.rotation(frame).copy()


def soft_starts(here, R):
    """References that begin where the tool is, for each kind of task."""
    down, turned = here + [0.0, 0.0, -0.2], exp_rotation(np.array([0.0, 0.4, 0.5])) @ R
    line, turn = osc.MinimumJerk(here, down, 1.0), osc.OrientationMinimumJerk(R, turned, 1.0)
    return {
        "position": (osc.PositionTask(name="led"), line),
        "via points": (osc.PositionTask(name="led"), osc.ViaPoints([0, 1.0], [here, down])),
        "chain": (osc.PositionTask(name="led"), osc.Chain((0.0, line), (1.5, osc.Constant(down)))),
        "orientation": (osc.OrientationTask(name="led"), turn),
        "pose": (osc.PoseTask(name="led"), osc.PoseReference(line, turn)),
        "moving and constant": (osc.PoseTask(name="led"), osc.PoseReference(line, R)),
        "constant and turning": (osc.PoseTask(name="led"), osc.PoseReference(here, turn)),
    }


@KINDS
@CLOCKS
@pytest.mark.parametrize("which", list(soft_starts(A, np.eye(3))))
def test_a_soft_start_is_soft_whatever_the_clock_says(kind, clock, which):
    robot, here, R = arm()
    task, reference = soft_starts(here, R)[which]
    controller = kind(robot, osc.Stack([task, osc.PostureTask()]))
    q, v = robot.q_reference, np.zeros(6)
    before = controller.step(clock, q, v).tau
    task.target = reference
    taus = [controller.step(clock + k * DT, q, v).tau for k in range(1, 4)]
    assert np.abs(np.diff([before, *taus], axis=0)).max() < 0.5
    assert np.abs(controller.step(clock + 0.5, q, v).tau - before).max() > 1.0  # it goes on


@KINDS
def test_what_is_assigned_again_begins_again(kind):
    robot, here, _ = arm()
    hand, reference = osc.PositionTask(), osc.MinimumJerk(here, here + [0, 0, 0.1], 1.0)
    controller = kind(robot, osc.Stack([hand, osc.PostureTask()]))

    def error(t):
        command = controller.step(t, robot.q_reference, np.zeros(6))
        return command.tasks["position"].error_norm

    for begin in (2.0, 4.0):
        hand.target = reference
        assert error(begin) < 1e-9
        assert error(begin + 0.5) == pytest.approx(0.05)
        assert error(begin + 1.0) == pytest.approx(0.1)
    assert error(1e3) == pytest.approx(0.1)  # and stays at its goal


@KINDS
def test_a_start_time_and_a_function_of_time_are_in_the_time_of_the_clock(kind):
    robot, here, _ = arm()
    line = osc.MinimumJerk(here, here + [0, 0, 0.1], 1.0, start_time=3.0)
    for target in (line, line.__call__):  # a method is a plain function of time
        hand = osc.PositionTask(target=target)
        controller = kind(robot, osc.Stack([hand, osc.PostureTask()]))
        command = controller.step(3.5, robot.q_reference, np.zeros(6))
        assert command.tasks["position"].error_norm == pytest.approx(0.05)


@KINDS
def test_a_task_that_is_inserted_later_begins_then(kind):
    robot, here, _ = arm()
    hand = osc.PositionTask(target=osc.MinimumJerk(here, here + [0, 0, 0.1], 1.0))
    controller = kind(robot, osc.Stack([osc.PostureTask()]))
    q, v = robot.q_reference, np.zeros(6)
    controller.step(0.0, q, v)
    controller.stack.insert(hand, -1.0, 0.1, start_time=2.0)
    controller.step(1.0, q, v)
    assert controller.step(2.0, q, v).tasks["position"].error_norm < 1e-9
    assert controller.step(2.5, q, v).tasks["position"].error_norm == pytest.approx(0.05)


# --- constants and parts -----------------------------------------------------------------------------

QUATERNION = quaternion_from_matrix(R0)
POSE = np.block([[R0, A[:, None]], [np.zeros((1, 3)), np.ones((1, 1))]])


@KINDS
@pytest.mark.parametrize(
    ("task", "value"),
    [
        (osc.PositionTask, A),
        (osc.OrientationTask, R0),
        (osc.OrientationTask, QUATERNION),
        (osc.PoseTask, POSE),
        (osc.PoseTask, (A, R0)),
        (osc.PoseTask, [A, QUATERNION]),
        (osc.PoseTask, [*A, *QUATERNION]),
        (osc.PostureTask, np.full(6, 0.1)),
        (lambda: osc.PostureTask(joints=["joint1", "joint2", "joint3", "joint4"]), np.ones(4)),
        (lambda: osc.JointTask("joint2"), 0.3),
    ],
)
def test_a_constant_is_what_its_value_is(kind, task, value):
    robot = osc.load_robot("puma560")
    taus = []
    for target in (value, osc.Constant(value), osc.Chain((0.0, osc.Constant(value)))):
        followed = task()
        followed.target = target
        controller = kind(robot, osc.Stack([followed]))
        taus.append(controller.step(1.0, robot.q_reference, np.full(6, 0.1)).tau)
    np.testing.assert_allclose(taus[1:], [taus[0], taus[0]], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("task", "value", "reason"),
    [
        (osc.OrientationTask(), 1.1 * np.eye(3), "'orientation': target is not a rotation"),
        (osc.PositionTask(), R0, "'position': target must have shape"),
        (osc.PoseTask(), A, "'pose': target must be"),
    ],
)
def test_a_constant_that_does_not_fit_is_refused_when_it_is_assigned(task, value, reason):
    with pytest.raises(osc.InputError, match=reason):
        task.target = osc.Constant(value)


@pytest.mark.parametrize(
    ("position", "orientation", "reason"),
    [
        (R0, R0, "PoseReference: position must have shape"),
        (A, A, "PoseReference: orientation must be"),
        ("there", R0, "must be numbers"),
        (A, 2.0 * np.eye(3), "PoseReference: orientation is not a rotation"),
        (osc.Constant(B[:2]), R0, "PoseReference: position must have shape"),
    ],
)
def test_parts_that_are_none_are_refused_at_once(position, orientation, reason):
    with pytest.raises(osc.InputError, match=reason):
        osc.PoseReference(position, orientation)


@pytest.mark.parametrize(
    ("position", "orientation", "reason"),
    [
        (lambda t: A, R0, "the position must give a Sample"),
        (lambda t: osc.Sample(R0, A, A), R0, "PoseReference: position must have shape"),
        (lambda t: osc.Sample(A, A[:2], A), R0, "PoseReference: position velocity"),
        (A, lambda t: osc.Sample(A, A, A), "PoseReference: orientation must be"),
        (A, lambda t: osc.Sample(R0, A, np.eye(3)), "PoseReference: orientation acceleration"),
    ],
)
def test_parts_that_fail_later_are_named(position, orientation, reason):
    robot = osc.load_robot("puma560")
    task = osc.PoseTask(target=osc.PoseReference(position, orientation))
    task.bind(robot)
    with pytest.raises(osc.InputError, match=reason):
        task.evaluate(robot, 0.0)
