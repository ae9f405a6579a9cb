"""Torques at many states at once against single ticks."""

from __future__ import annotations

import numpy as np
import pytest

import opspace as osc
from opspace.kernels.columns import REMEMBERS, TURN
from opspace.robots import available_robots
from tests.controller.test_compiled import Spring, circle

INSTALLED = {info.name for info in available_robots() if info.installed}
ROBOTS = [
    ("puma560", "pinocchio"),
    ("puma560", "mujoco"),
    *((name, "pinocchio") for name in ("panda", "ur5") if name in INSTALLED),
]
DT = 1e-3


def controller_of(robot, tasks=None, **options):
    arm = osc.load_robot(robot[0], backend=robot[1])
    tasks = tasks or [
        osc.JointLimits(),
        osc.OrientationTask(),
        osc.PositionTask(max_speed=0.5),
        osc.PostureTask(),
    ]
    return osc.Controller(arm, osc.Stack(tasks), **options)


def states(robot, count, seed=0, spread=0.8):
    """States of which many are singular, near a limit, or beyond it."""
    rng = np.random.default_rng(seed)
    q = robot.q_reference + rng.uniform(-spread, spread, (count, robot.nv))
    far = np.clip(np.maximum(-robot.q_lower, robot.q_upper), 1.0, 7.0) + 0.1
    q[::5] = rng.uniform(-far, far, q[::5].shape)
    return q, rng.uniform(-1.0, 1.0, (count, robot.nv))


def remembered(controller, t):
    """What one tick leaves to the next: groups of the blend, and which way rotations went."""
    plan = controller._plan
    if plan is None:
        return []
    plan.refresh(controller.robot, t)  # a target that has jumped since then makes it forget
    tick = plan.tick
    return [tick.group, tick.kind[:, REMEMBERS], tick.numbers[:, TURN : TURN + 4]]


def assert_rows_are_ticks(controller, count=40, t=None, seed=0):
    """Each row is the next tick: the memory of rotations must not carry from one to the other."""
    q, v = states(controller.robot, count, seed)
    found = controller.torque_batch(q, v, t)
    statuses = osc.Status.OK
    t = controller.stack.time if t is None else t
    memory = remembered(controller, t)
    kept = [part.copy() for part in memory]
    for row, q_row, v_row in zip(found, q, v, strict=True):
        command = controller.step(t, q_row, v_row)
        assert np.max(np.abs(row - command.tau)) <= 1e-9 * max(1.0, np.max(np.abs(command.tau)))
        statuses |= command.status
        for part, before in zip(memory, kept, strict=True):
            part[:] = before
    return statuses


def started(robot, tasks=None, **options):
    controller = controller_of(robot, tasks, **options)
    controller.step(0.0, controller.robot.q_reference, np.zeros(controller.robot.nv))
    return controller


@pytest.mark.parametrize("robot", ROBOTS, ids="-".join)
def test_rows_are_ticks_with_singular_directions_and_limits(robot):
    statuses = assert_rows_are_ticks(started(robot), 80)
    assert statuses & osc.Status.DIRECTION_OFF
    assert statuses & osc.Status.JOINT_LIMIT


@pytest.mark.parametrize("robot", ROBOTS, ids="-".join)
@pytest.mark.parametrize("blending", ["auto", "idv", "chain"])
def test_rows_are_ticks_midway(robot, blending):
    controller = started(robot, blending=blending)
    stack = controller.stack
    joints = controller.robot.joint_names
    stack.swap("orientation", "position", 0.5)
    stack.remove("posture", 0.4)
    stack.insert(osc.JointTask(joints[1], 0.2), 0.5, 0.3)
    stack.insert(osc.JointTask(joints[3], -0.2), -1.0, 0.6)
    q, v = states(controller.robot, 3)
    for k in range(1, 4):
        controller.step(k * 0.05, q[0], v[0])
    moving = controller.step(0.15, q[0], v[0]).tasks.values()
    assert sum(0.0 < task.activation < 1.0 for task in moving) == 3
    assert_rows_are_ticks(controller)
    assert_rows_are_ticks(controller, t=0.2)


@pytest.mark.parametrize(
    "options",
    [
        {"bias": "task"},
        {"torque_limits": "priority"},
        {"singularity": None},
        {"singularity": osc.Singularity(0.01, 0.5, scale="absolute")},
        {"damping": 0.0},
    ],
    ids=str,
)
def test_rows_are_ticks_with_every_option(options):
    assert_rows_are_ticks(started(ROBOTS[0], **options))


def test_every_kind_of_task():
    pose = osc.PoseTask(axes_frame="tool", target=np.eye(4))
    robot = ROBOTS[-1]
    link = osc.load_robot(robot[0]).frame_names[4]
    tasks = [
        osc.JointLimits(0.3, mode="buffer"),
        [osc.PositionTask(target=circle), osc.RelativePositionTask(None, link, axes="x")],
        osc.ComTask(axes="z"),
        pose,
    ]
    controller = started(robot, tasks)
    assert_rows_are_ticks(controller)
    pose.target = np.diag([1.0, -1.0, -1.0, 1.0])
    pose.kp = 33.0
    controller.torque_batch(*states(controller.robot, 2))
    assert_rows_are_ticks(controller, t=0.7)


def test_a_rotation_goes_on_the_way_that_it_went():
    controller = started(ROBOTS[0], [osc.OrientationTask()])
    q, v = controller.robot.q_reference.copy(), np.zeros(6)
    for k in range(165):  # past half a turn
        q[0] += 0.02
        error = controller.step(k * DT, q, v).tasks["orientation"].error_norm
    assert error > np.pi
    found = controller.torque_batch([q], [v])
    np.testing.assert_allclose(found[0], controller.step(0.165, q, v).tau, rtol=0, atol=1e-9)


def test_activations_of_the_state_are_those_of_each_row():
    height = osc.PositionTask(axes="z", name="height", target=[0, 0, 0.2])
    height.activation = osc.JointBuffer(osc.load_robot("puma560").joint_names[1], -0.2, 0.9)
    controller = started(ROBOTS[0], [height, osc.PostureTask()])
    assert_rows_are_ticks(controller)
    height.activation = lambda robot, t: 1.5
    with pytest.raises(osc.InputError, match=r"'height'.*activation"):
        controller.torque_batch(*states(controller.robot, 2))


def test_it_needs_no_tick_where_everything_has_a_target():
    robot = osc.load_robot("puma560")
    tasks = [osc.PositionTask(target=[0.3, 0.2, 0.4]), osc.PostureTask(robot.q_reference)]
    controller = osc.Controller(robot, osc.Stack(tasks))
    assert_rows_are_ticks(controller, t=0.0)
    waiting = osc.Controller(osc.load_robot("puma560"), osc.Stack([osc.PositionTask()]))
    with pytest.raises(osc.InputError, match="'position' will hold what it finds"):
        waiting.torque_batch(*states(robot, 2))


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_change_nothing(threads):
    controller = started(ROBOTS[0])
    q, v = states(controller.robot, 1000)
    one = controller.torque_batch(q, v, threads=1)
    np.testing.assert_array_equal(controller.torque_batch(q, v, threads=threads), one)
    assert controller.torque_batch(q[:0], v[:0]).shape == (0, 6)


def test_nothing_of_the_controller_changes():
    first, second = started(ROBOTS[-1]), started(ROBOTS[-1])
    rng = np.random.default_rng(4)
    q, v = states(first.robot, 200)
    for controller in (first, second):
        controller.stack.swap("orientation", "position", 0.02)
    for k in range(1, 40):
        if k == 10:
            for controller in (first, second):
                controller.stack.insert(osc.JointTask(first.robot.joint_names[2], 0.1), 0.5, 0.01)
        before = (first.robot.q.copy(), first.robot.M.copy(), first.stack.time)
        first.torque_batch(q, v, None if k % 2 else 3.0)
        np.testing.assert_array_equal(first.robot.q, before[0])
        np.testing.assert_array_equal(first.robot.M, before[1])
        assert first.stack.time == before[2]
        state = q[0] + rng.uniform(-0.1, 0.1, first.robot.nv)
        one, other = (c.step(k * DT, state, v[0]) for c in (first, second))
        np.testing.assert_array_equal(one.tau, other.tau)
        assert one.status == other.status
        for a, b in zip(one.levels, other.levels, strict=True):
            np.testing.assert_array_equal(a.sigma, b.sigma)


def test_a_model_that_gives_nothing_brakes_as_a_tick_does():
    controller = started(ROBOTS[0])
    q, v = states(controller.robot, 3)
    v[1] = 1e200  # its bias overflows
    found = controller.torque_batch(q, v)
    command = controller.step(0.0, q[1], v[1])
    assert command.status & osc.Status.FAULT
    # Which sums overflow, and to what, depends on their order.
    assert np.isfinite(found).all()
    assert (np.abs(found[1]) <= controller.robot.torque_limit).all()
    np.testing.assert_allclose(found[0], controller.step(0.0, q[0], v[0]).tau, atol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda q, v: (q[:, :5], v), r"Q for puma560 has shape \(4, 5\), not \(states, 6\)"),
        (lambda q, v: (q, v[0]), r"V for puma560 has shape \(6,\)"),
        (lambda q, v: (q, v[:3]), "Q has 4 rows, V has 3"),
        (lambda q, v: (put(q, 2, 1, np.nan), v), r"row 2: q\[1\].*joint2.*nan"),
        (lambda q, v: (q, put(v, 3, 0, np.inf)), r"row 3: velocity.*joint1.*inf"),
        (lambda q, v: ([*q.tolist(), [1.0]], v), r"row 4: Q must be numbers"),
        (lambda q, v: ("state", v), "Q must be numbers"),
    ],
)
def test_bad_states_are_refused_by_row(change, message):
    controller = started(ROBOTS[0])
    with pytest.raises(osc.InputError, match=message):
        controller.torque_batch(*change(*states(controller.robot, 4)))


def put(array, row, column, value):
    array[row, column] = value
    return array


def test_bad_arguments_are_refused():
    controller = started(ROBOTS[0])
    q, v = states(controller.robot, 4)
    with pytest.raises(osc.InputError, match="time must be finite"):
        controller.torque_batch(q, v, np.nan)
    with pytest.raises(osc.InputError, match="at least one thread"):
        controller.torque_batch(q, v, threads=0)


def test_a_task_of_ones_own_is_refused_by_name():
    controller = started(ROBOTS[0], [Spring(), osc.PostureTask()])
    with pytest.raises(osc.InputError, match=r"'spring' \(Spring\) is evaluated in Python"):
        controller.torque_batch(*states(controller.robot, 2))
    many = [osc.PositionTask(axes="z", name=f"height{k}") for k in range(40)]
    with pytest.raises(osc.InputError, match="more than a batch can take"):
        started(ROBOTS[0], many).torque_batch(*states(controller.robot, 2))


def test_whatever_holds_the_states_gives_the_same():
    for robot in ROBOTS:
        controller = started(robot)
        q, v = states(controller.robot, 2)
        frozen = q.copy()
        frozen.setflags(write=False)
        expected = controller.torque_batch(q, v)
        for given in (frozen, np.asfortranarray(q), q.tolist()):
            np.testing.assert_array_equal(controller.torque_batch(given, v), expected)
        single = controller.torque_batch(q.astype(np.float32), v)
        np.testing.assert_allclose(single, expected, rtol=1e-3, atol=1e-2)
