"""Targets that jump are approached within limits, so that the torque does not step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.controller import ReferenceController
from opspace.scenario.build import build
from opspace.scenario.load import load_scenario
from opspace.tasks.rotation import exp_rotation, log_rotation
from opspace.tasks.ways import JERK_TIME, Pace, PoseWay, RotationWay, VectorWay
from tests.tasks.test_way_round import wrist

DT = 1e-3
KINDS = pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
PACE = Pace(0.4, 1.5)

vectors = st.tuples(*[st.floats(-0.8, 0.8)] * 3).map(np.array)
rates = st.tuples(*[st.floats(-0.2, 0.2)] * 3).map(np.array)


def assert_within(samples, dt):
    """Speed, acceleration and jerk along the way; twice of them where it begins across itself."""
    v, a = np.array([s.v for s in samples]), np.array([s.a for s in samples])
    assert np.linalg.norm(v, axis=1).max() <= PACE.speed * 1.0001
    assert np.linalg.norm(a, axis=1).max() <= PACE.acceleration * 1.0001
    jerk = np.linalg.norm(np.diff(a, axis=0), axis=1).max() / dt
    assert jerk <= PACE.acceleration / JERK_TIME * 1.001 + 1e-9


@given(vectors, vectors)
def test_a_way_from_rest_is_straight_and_within_its_limits(start, goal):
    rest = np.zeros(3)
    way = VectorWay.to(osc.Sample(start, rest, rest), goal, 2.0, PACE)
    times = np.linspace(2.0, way.end, 80)
    samples = [way(t) for t in times]
    assert_within(samples, max(times[1] - times[0], 1e-9))
    np.testing.assert_allclose(samples[0].x, start, atol=1e-12)
    np.testing.assert_array_equal(way(way.end).x, goal)
    np.testing.assert_array_equal(way(way.end + 1.0).v, rest)
    apart = np.array([s.x - start for s in samples])
    off = np.cross(apart, goal - start)
    assert np.abs(off).max() < 1e-9


@given(vectors, vectors)
def test_a_turn_from_rest_is_about_one_axis_and_within_its_limits(first, second):
    rest, R, goal = np.zeros(3), exp_rotation(first), exp_rotation(second)
    way = RotationWay.to(osc.Sample(R, rest, rest), goal, 0.0, PACE)
    times = np.linspace(0.0, way.end, 60)
    samples = [way(t) for t in times]
    assert_within(samples, max(times[1] - times[0], 1e-9))
    np.testing.assert_array_equal(way(way.end).x, goal)
    whole = log_rotation(goal @ R.T)
    for sample in samples:
        assert np.linalg.norm(np.cross(log_rotation(sample.x @ R.T), whole)) < 1e-7


@given(vectors, vectors, rates, rates)
def test_a_way_begins_with_what_is_followed(start, goal, velocity, acceleration):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = exp_rotation(start), start
    end = np.eye(4)
    end[:3, :3], end[:3, 3] = exp_rotation(goal), goal
    now = osc.Sample(
        pose, np.concatenate((velocity, acceleration)), np.concatenate((acceleration, velocity))
    )
    way = PoseWay.to(now, end, 3.0, PACE, PACE)
    for one, two in zip(way(3.0), now, strict=True):
        np.testing.assert_allclose(one, two, atol=1e-9)
    np.testing.assert_allclose(way(way.end).x, end, atol=1e-12)


# --- tasks -------------------------------------------------------------------------------------------

HERE = "where it is"


def goals(task, robot):
    """Two values of a task, both away from where it is."""
    robot.update(robot.q_reference, np.zeros(robot.nv))
    if isinstance(task, osc.PostureTask):
        some = robot.q_reference[[1]] if isinstance(task, osc.JointTask) else robot.q_reference
        return some + 0.4, some - 0.3
    now = task.desired(robot, 0.0).x
    if now.shape == (3,):
        reach = 1.0 if isinstance(task, osc.PositionTask) else 0.2
        return now + reach * np.array([0.1, 0.2, -0.1]), now + reach * np.array([-0.2, 0.1, 0.1])
    relative = isinstance(task, osc.RelativePoseTask)
    turn = exp_rotation((0.3 if relative else 1.0) * np.array([0.5, -0.7, 0.4]))
    if now.shape == (3, 3):
        return turn @ now, turn.T @ now
    first, second = now.copy(), now.copy()
    first[:3, 3] += (0.2 if relative else 1.0) * np.array([0.1, 0.2, -0.1])
    first[:3, :3] = turn @ now[:3, :3]
    second[:3, :3] = turn.T @ now[:3, :3]
    return first, second


PACED = {"max_speed": 0.5, "max_acceleration": 2.0}
BOTH = {"max_speed": (0.5, 1.0), "max_acceleration": (2.0, 4.0)}
TASKS = {
    "position": lambda: osc.PositionTask(**PACED),
    "position in tool axes": lambda: osc.PositionTask(axes="xz", axes_frame="tool", **PACED),
    "orientation": lambda: osc.OrientationTask(**PACED),
    "pose": lambda: osc.PoseTask(**BOTH),
    "centre of mass": lambda: osc.ComTask(max_speed=0.05, max_acceleration=0.2),
    "relative": lambda: osc.RelativePositionTask(None, "link1", **PACED),
    "relative pose": lambda: osc.RelativePoseTask(None, "link1", **BOTH),
    "posture": lambda: osc.PostureTask(name="first", **PACED),
    "joint": lambda: osc.JointTask("joint2", **PACED),
}


def steps(kind, make, limited=True):
    """The largest step of the torque while targets jump, the arm following exactly."""
    robot, model = osc.load_robot("puma560"), osc.load_robot("puma560")
    task = make()
    if not limited:
        task.max_acceleration = None
    controller = kind(robot, osc.Stack([task, osc.PostureTask()]))
    q, v, taus, errors = robot.q_reference.copy(), np.zeros(6), [], []
    first, second = None, None
    for k in range(700):
        if k == 10:
            first, second = goals(task, robot)
            task.target = first
        if k == 200:  # on its way
            task.target = second
        command = controller.step(k * DT, q, v)
        taus.append(command.tau)
        errors.append(command.tasks[task.name].error_norm)
        model.update(q, v)
        v = v + DT * np.linalg.solve(model.M, command.tau - model.bias)
        q = q + DT * v
    return np.abs(np.diff(taus, axis=0)).max(), errors


@KINDS
@pytest.mark.parametrize("name", list(TASKS))
def test_a_target_that_jumps_does_not_step_the_torque(kind, name):
    largest, errors = steps(kind, TASKS[name])
    assert largest < 1.0
    if kind is osc.Controller:
        jumping, _ = steps(kind, TASKS[name], limited=False)
        assert jumping > 5.0 * largest
    if name != "relative pose":  # five joints have no way there
        assert max(errors) < 0.05


@KINDS
@pytest.mark.parametrize("name", list(TASKS))
def test_a_target_that_jumps_after_an_arrival_does_not_step_the_torque(kind, name):
    """Also where a pose has arrived with its place or its turn alone."""
    robot, task = osc.load_robot("puma560"), TASKS[name]()
    q, v = robot.q_reference, np.zeros(6)
    controller = kind(robot, osc.Stack([task, osc.PostureTask()]))
    controller.step(0.0, q, v)
    targets, t = goals(task, robot), 1.0
    for k in range(4):
        task.target = targets[k % 2]
        controller.step(t, q, v)
        way = task.way
        ends = sorted((way.place.end, way.turn.end)) if isinstance(way, PoseWay) else [way.end]
        t = ends[0 if k % 2 else -1] + 0.5 * DT
        before = controller.step(t, q, v).tau
        task.target = targets[(k + 1) % 2]
        t += DT
        after = controller.step(t, q, v).tau
        assert np.abs(after - before).max() < 1.0
        t = task.way.end + 1.0
        controller.step(t, q, v)


def at_rest(kind, **options):
    """An arm with a task on ways, the place of its tool, and how it answers there at some time."""
    robot = osc.load_robot("puma560")
    q, v = robot.q_reference, np.zeros(6)
    robot.update(q, v)
    hand = osc.PositionTask(**(PACED | options))
    controller = kind(robot, osc.Stack([hand, osc.PostureTask(target=q)]))
    x = robot.position(robot.tool).copy()
    return controller, hand, x, lambda t: controller.step(t, q, v).tau


@KINDS
@pytest.mark.parametrize("returns", [0, 1, 3])
def test_a_way_begins_at_a_value_with_a_velocity_that_is_followed_anew(kind, returns):
    """After a restart, or where a plan that is kept is taken up again."""
    controller, hand, x, torque = at_rest(kind)
    hand.set_target(x + [0.0, 0.0, 0.02], [0.01, 0.0, 0.0])
    torque(1.0)
    for k in range(returns):
        controller.stack.remove(hand, 0.0)
        torque(2.0 + 4.0 * k)
        controller.stack.insert(hand, 0.0, 0.0)
        torque(3.0 + 4.0 * k)
    if not returns:
        controller.restart()
        torque(2.0)
    before = torque(20.0)
    hand.set_target(x + [0.0, 0.0, 0.03])
    assert np.abs(torque(20.0 + DT) - before).max() < 1.0


@KINDS
def test_a_way_goes_on_in_another_plan_where_none_would_begin_any_more(kind):
    controller, hand, x, torque = at_rest(kind, max_speed=0.1, max_acceleration=1.0)
    torque(0.0)
    hand.target = x + [0.0, 0.0, 0.1]
    torque(1.0)
    hand.max_acceleration = None
    before = torque(1.3)
    controller.stack.insert(osc.JointTask("joint3"), 5.0, 0.3)
    assert np.abs(torque(1.3 + DT) - before).max() < 1.0


@KINDS
def test_no_way_begins_at_a_target_that_has_been_left_without_one(kind):
    _, hand, x, torque = at_rest(kind)
    torque(0.0)
    hand.target = x + [0.0, 0.0, 0.1]
    torque(1.0)
    torque(5.0)
    hand.max_acceleration = None
    hand.target = x
    before = torque(6.0)
    hand.max_acceleration = 2.0
    assert np.abs(torque(6.0 + DT) - before).max() < 1e-6


@KINDS
def test_a_task_that_comes_in_begins_where_it_finds_the_robot(kind):
    robot = osc.load_robot("puma560")
    q, v = robot.q_reference, np.zeros(6)
    controller = kind(robot, osc.Stack([osc.PostureTask()]))
    robot.update(q, v)
    away = robot.position(robot.frame_id(robot.tool)) + [0.3, 0.2, -0.2]
    hand = osc.PositionTask(target=away, max_speed=0.3, max_acceleration=1.0)
    controller.step(0.0, q, v)
    for begin in (1.0, 5.0):
        controller.stack.insert(hand, -1.0, 0.0)
        for k in range(3):
            command = controller.step(begin + k * DT, q, v)
            assert command.tasks["position"].error_norm < 1e-6
        controller.stack.remove(hand, 0.0)
        controller.step(begin + 0.1, q, v)


def test_what_is_followed_before_is_where_the_way_begins():
    """A held value, a reference on its way, and a way on its way."""
    robot = osc.load_robot("puma560")
    q = robot.q_reference
    task = osc.JointTask("joint2", max_speed=0.5, max_acceleration=2.0)
    task.bind(robot)
    robot.update(q, np.zeros(6))
    held = task.desired(robot, 0.0)
    moving = osc.MinimumJerk([float(held.x[0])], [float(held.x[0]) + 0.3], 1.0, start_time=1.0)
    robot.update(q + 0.2, np.zeros(6))
    for t, target in ((0.5, 0.4), (0.9, None), (1.0, moving), (1.4, -0.2), (1.6, 0.9)):
        before = task.desired(robot, t)
        task.target = target
        if not (target is None or callable(target)):
            for one, two in zip(task.desired(robot, t), before, strict=True):
                np.testing.assert_allclose(one, two, atol=1e-9)
    np.testing.assert_array_equal(task.desired(robot, 20.0).x, [0.9])
    assert task.moves(1.7)
    assert not task.moves(20.0)


def test_the_same_value_again_is_the_same_way():
    task, robot = osc.PositionTask(max_speed=0.5, max_acceleration=2.0), osc.load_robot("puma560")
    task.bind(robot)
    robot.update(robot.q_reference, np.zeros(6))
    task.target = [0.3, 0.2, 0.4]
    task.desired(robot, 0.0)
    way = task._led.way
    for k in range(5):
        task.target = [0.3, 0.2, 0.4]
        task.desired(robot, k * DT)
        assert task._led.way is way
    task.target = [0.3, 0.2, 0.5]
    task.desired(robot, 0.1)
    assert task._led.way is not way


def test_a_value_with_a_velocity_is_followed_as_it_is():
    task = osc.PositionTask(max_speed=0.5, max_acceleration=2.0)
    robot = osc.load_robot("puma560")
    task.bind(robot)
    task.desired(robot, 0.0)
    task.set_target([0.1, 0.2, 0.3], [0.1, 0.0, 0.0])
    np.testing.assert_array_equal(task.desired(robot, 0.0).x, [0.1, 0.2, 0.3])


@KINDS
def test_a_joint_without_end_goes_the_short_way(tmp_path, kind):
    robot = osc.load_robot(wrist(tmp_path))
    task = osc.JointTask("j1", max_speed=3.0, max_acceleration=10.0)
    controller = kind(robot, osc.Stack([task, osc.PostureTask()]))
    q, v = np.array([3.0, 0.0, 0.0]), np.zeros(3)
    controller.step(0.0, q, v)
    task.target = -3.0
    command = controller.step(10.0, q, v)  # begins
    command = controller.step(20.0, q, v)  # has arrived
    assert command.tasks["j1"].error[0] == pytest.approx(2.0 * math.pi - 6.0)


def test_a_batch_begins_nothing():
    robot = osc.load_robot("puma560")
    q, v = robot.q_reference, np.zeros(6)
    hand = osc.PositionTask(max_speed=0.5, max_acceleration=2.0)
    turn = osc.OrientationTask()
    controller = osc.Controller(robot, osc.Stack([hand, turn, osc.PostureTask()]))
    hand.target = [0.5, 0.1, 0.3]
    with pytest.raises(osc.InputError, match="'position' will begin its way where its first tick"):
        controller.torque_batch([q], [v])
    hand.target = None
    controller.step(0.0, q, v)
    robot.update(q, v)
    frame = robot.frame_id(robot.tool)
    here, R = robot.position(frame).copy(), robot.rotation(frame).copy()
    hand.target = here + 0.1
    turn.target = osc.OrientationMinimumJerk(R, exp_rotation(np.array([0, 0, 1.0])) @ R, 1.0)
    for t in (0.4, 0.8):
        first = controller.torque_batch([q, q], [v, v], t)
    command = controller.step(1.0, q, v)  # both begin here
    np.testing.assert_allclose(first[0], command.tau, atol=1e-9)
    assert command.tasks["position"].error_norm < 1e-9
    assert command.tasks["orientation"].error_norm < 1e-9
    later = controller.torque_batch([q], [v], 1.3)[0]
    np.testing.assert_allclose(later, controller.step(1.3, q, v).tau, atol=1e-9)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"max_acceleration": 1.0}, "needs max_speed"),
        ({"max_acceleration": 0.0, "max_speed": 1.0}, "above zero"),
        ({"max_acceleration": np.inf, "max_speed": 1.0}, "finite"),
        ({"max_acceleration": 1.0, "max_speed": np.inf}, "finite"),
        ({"max_acceleration": [1.0, 2.0], "max_speed": 1.0}, "1 number"),
        ({"max_acceleration": "fast", "max_speed": 1.0}, "numbers"),
    ],
)
def test_unusable_accelerations_name_the_task(options, reason):
    with pytest.raises(osc.InputError, match=f"'reach'.*{reason}"):
        osc.PositionTask(name="reach", **options)


def test_an_acceleration_may_be_given_later_and_keeps_its_speed():
    task = osc.PoseTask(max_speed=(0.5, 1.0))
    task.max_acceleration = (2.0, 3.0)
    task.kp = 50.0
    task.max_speed = (0.25, 1.0)
    assert task.max_acceleration == (2.0, 3.0)
    with pytest.raises(osc.InputError, match="needs max_speed"):
        task.max_speed = None
    task.max_acceleration = None
    task.max_speed = None


def test_scenarios_know_it(tmp_path):
    path = tmp_path / "paced.yaml"
    path.write_text(
        "robot: puma560\nduration: 0.1\ntasks:\n"
        "  hand: {type: position, level: 0, max_speed: 0.5, max_acceleration: 2.0}\n"
        "  posture: {type: posture, level: 1}\n"
    )
    assert build(load_scenario(path)).controller.stack["hand"].max_acceleration == 2.0


def test_the_guide_for_hardware_says_how_much_a_jump_steps():
    """18 N·m, with its gains on its arm, and next to nothing with max_acceleration."""
    taus = {}
    for acceleration in (None, 1.0):
        robot = osc.load_robot("puma560")
        hand = osc.PositionTask(kp=50.0, max_speed=0.25, max_acceleration=acceleration)
        turn, rest = osc.OrientationTask(kp=50.0, max_speed=0.5), osc.PostureTask(kp=16.0)
        stack = osc.Stack([turn, hand, rest], limits=osc.JointLimits())
        controller = osc.Controller(robot, stack, torque_limits="priority")
        q, v = robot.q_reference, np.zeros(6)
        before = controller.step(0.0, q, v).tau
        robot.update(q, v)
        hand.target = robot.position(robot.frame_id(robot.tool)) + [0.0, 0.3, 0.0]
        taus[acceleration] = np.abs(controller.step(DT, q, v).tau - before).max()
    assert taus[None] == pytest.approx(18.0, abs=0.5)
    assert taus[1.0] < 1e-6
