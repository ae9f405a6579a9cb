"""Joint limits: the guarantee, the law of insertion, and continuity."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.command import Status
from opspace.controller import Controller, ReferenceController
from opspace.controller.limit_task_sets import braking
from opspace.errors import InputError, UnknownNameError
from opspace.law.scalars import LEFT, LIMIT_LAWS, allowed_speed, last_command, stopping_command
from opspace.loop import simulate
from opspace.robots import load_robot
from opspace.sim import Plant
from opspace.stack import Stack
from opspace.tasks import JointLimits, MinimumJerk, OrientationTask, PositionTask, PostureTask
from opspace.tasks.joint_limits import Side

SEEDS = st.integers(0, 2**32 - 1)
DT = 0.001


@pytest.fixture(scope="module")
def robot():
    return load_robot("puma560")


@settings(max_examples=300)
@given(
    SEEDS, st.floats(2.0, 50.0), st.floats(0.0, 2.0), st.floats(0.0, 1.0), st.sampled_from([-1, 1])
)
def test_a_joint_that_obeys_never_passes_its_limit(seed, brake, room, fraction, sign):
    """From any admissible start, whatever the rest of the stack asks for, at 1 kHz."""
    rng = np.random.default_rng(seed)
    side = Side("joint", 0, sign, 0.7, brake)
    limits = JointLimits()
    allowed, _ = allowed_speed(room, brake, limits.k1)
    q, v = 0.7 - sign * room, sign * fraction * allowed
    wish = 0.0
    hardest = 0.0
    for tick in range(1500):
        if tick % 50 == 0:
            wish = rng.uniform(-300.0, 600.0)
        admissible = limits.admissible(side, q, v)
        a = sign * min(wish, admissible)
        if sign * a < 0 and wish > 0:
            hardest = max(hardest, -sign * a)
        v += a * DT
        q += v * DT
        assert sign * (q - 0.7) <= 1e-9
    assert hardest <= 1.1 * brake + 1e-9


@settings(max_examples=300)
@given(st.floats(2.0, 50.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_who_is_not_too_fast_need_not_hurry(brake, room, fraction):
    allowed, _ = allowed_speed(room, brake, JointLimits.k1)
    slow = min(fraction * allowed, allowed)
    assert stopping_command(room, slow, brake, 1e9, JointLimits.k1, DT) == math.inf
    assert last_command(room, slow, brake, JointLimits.k1) == math.inf
    # Where hurry begins it asks for no more than the curve does.
    barely = allowed * (1.0 + 1e-9) + 1e-12
    hurried = stopping_command(room, barely, brake, 1e9, JointLimits.k1, DT)
    curve = LIMIT_LAWS["admissible"].command(
        room, barely, brake, math.inf, JointLimits.k1, JointLimits.k2, 0.0, 0.0
    )
    assert hurried >= curve - 1e-6 * (1.0 + abs(curve))


@settings(max_examples=300)
@given(st.floats(2.0, 50.0), st.floats(1e-4, 0.5), st.floats(0.0, 4.0), st.booleans())
def test_a_joint_that_is_too_fast_stops_where_its_motor_can_stop_it(brake, room, speed, exact):
    """Whether v ends the tick before the position moves, or the acceleration is integrated exactly."""
    side, limits = Side("joint", 0, 1.0, 0.0, brake), JointLimits()
    speed = min(speed, 0.9 * room / DT)
    most = 1.1 * speed * speed / (2.0 * max(room - speed * DT, 0.1 * room))
    q, v, passed = -room, speed, -room
    for _ in range(1500):
        a = limits.admissible(side, q, v)
        a = min(a, limits.hurry(side, q, v, most, DT)[0])
        q += DT * (v + (0.5 if exact else 1.0) * DT * a)
        v += DT * a
        passed = max(passed, q)
    assert passed <= 1e-4


@settings(max_examples=300)
@given(st.floats(-1.0, 3.0), st.floats(2.0, 50.0))
def test_the_admissible_speed_is_once_differentiable_in_the_distance(distance, brake):
    limits, d = JointLimits(), 1e-7
    knee = brake / limits.k1**2
    for x in (distance, 0.0, knee):
        (below, s0), (_, slope), (above, s1) = (
            allowed_speed(x + k * d, brake, limits.k1) for k in (-1, 0, 1)
        )
        assert (above - below) / (2 * d) == pytest.approx(slope, abs=1e-3)
        assert abs(s1 - s0) < 1e-2
    assert allowed_speed(0.0, brake, limits.k1)[0] == 0.0


@settings(max_examples=300)
@given(st.floats(-2.0, -1e-3))
def test_outside_the_limit_only_the_way_back_is_admissible(distance):
    allowed, _ = allowed_speed(distance, 20.0, JointLimits.k1)
    assert -0.5 <= allowed < 0.0


def controller_for(robot, limits):
    stack = Stack([limits, OrientationTask(), PositionTask(), PostureTask()])
    controller = Controller(robot, stack)
    controller.step(0.0, robot.q_reference, np.zeros(6))
    return controller


def joint_acceleration(robot, q, v, tau):
    robot.update(q, v)
    return np.linalg.solve(robot.M, tau - robot.bias)


@settings(max_examples=40)
@given(SEEDS, st.floats(0.0, 0.2), st.floats(-1.0, 2.0))
def test_the_joint_gets_no_more_than_is_admissible_and_no_less_than_half(
    robot, seed, distance, speed
):
    """Unless it wishes less; half of it belongs to the first level alone."""
    rng = np.random.default_rng(seed)
    q = robot.q_reference + rng.uniform(-0.2, 0.2, 6)
    v = rng.uniform(-0.3, 0.3, 6)
    v[0] = speed
    joints = {"joint1": (-9.0, q[0] + distance)}
    joints |= {f"joint{i}": (-9.0, 9.0) for i in range(2, 7)}
    limits = JointLimits(joints=joints)
    free = controller_for(robot, JointLimits(joints={f"joint{i}": (-9, 9) for i in range(1, 7)}))
    limited = controller_for(robot, limits)
    wish = joint_acceleration(robot, q, v, free.step(0.0, q, v).tau)[0]
    command = limited.step(0.0, q, v)
    got = joint_acceleration(robot, q, v, command.tau)[0]
    side = next(s for s in limits.sides if s.name == "joint1/upper")
    most = braking(robot.M, robot.bias, robot.torque_limit)[0]
    admissible = min(
        limits.admissible(side, q[0], v[0]), limits.hurry(side, q[0], v[0], most, 0.0)[0]
    )
    tolerance = 1e-6 * (1 + abs(wish))
    assert got <= min(wish, admissible) + tolerance
    assert got >= min(wish, LEFT * admissible if admissible > 0.0 else admissible) - tolerance
    if wish > admissible:
        assert command.limits["joint1/upper"] > 0.0
        assert command.status & Status.JOINT_LIMIT


@pytest.mark.parametrize("mode", ["admissible", "buffer"])
def test_torque_is_continuous_where_limits_come_and_go(robot, mode):
    """Along a path through several limits, with speeds, ten times finer is ten times smoother."""
    joints = {"joint1": (-0.3, 0.1), "joint2": (0.7, 1.05), "joint5": (-1.5, -1.15)}
    controller = controller_for(robot, JointLimits(mode=mode, joints=joints))
    rng = np.random.default_rng(4)
    amplitude = rng.uniform(0.15, 0.35, 6)
    phase = rng.uniform(0, 6, 6)

    def steps(start, end, n):
        path, active = [], set()
        for s in np.linspace(start, end, n + 1):
            q = robot.q_reference + amplitude * np.sin(3 * s + phase)
            command = controller.step(0.0, q, 3 * amplitude * np.cos(3 * s + phase))
            active |= set(command.limits)
            path.append(command.tau)
        return np.max(np.abs(np.diff(path, axis=0)), axis=1), active

    coarse, active = steps(0.0, 2.0, 200)
    assert len(active) >= 2
    worst = int(np.argmax(coarse))
    fine, _ = steps(2.0 * worst / 200, 2.0 * (worst + 1) / 200, 10)
    assert np.max(fine) < 0.35 * coarse[worst]


@pytest.mark.parametrize("sign", [-1, 1])
def test_both_sides_are_mirror_images(sign):
    upper = Side("j", 0, 1.0, 0.75, 20.0)
    lower = Side("j", 0, -1.0, -0.75, 20.0)
    for limits in (JointLimits(), JointLimits(mode="buffer")):
        q, v = 0.6 * sign, 0.3
        command = limits.admissible(upper, q, v)
        assert command == limits.admissible(lower, -q, -v)
        assert limits.presence(upper, q, v) == limits.presence(lower, -q, -v)


def test_pushed_together_every_joint_keeps_its_limit(robot):
    """Holding one joint pushes others; after a few passes what is left is small beside the brake."""
    q = robot.q_reference.copy()
    joints = {f"joint{i + 1}": (q[i] - 0.01, q[i] + 0.01) for i in range(6)}
    limits = JointLimits(joints=joints)
    controller = controller_for(robot, limits)
    task = next(t for t in controller.stack if t.name == "position")
    robot.update(q, np.zeros(6))
    task.target = robot.position(robot.frame_id("tool")) + [0.3, 0.2, 0.1]
    command = controller.step(0.0, q, np.zeros(6))
    got = joint_acceleration(robot, q, np.zeros(6), command.tau)
    for side in limits.sides:
        bound = limits.admissible(side, q[side.index], 0.0)
        assert side.sign * got[side.index] <= bound + 1e-3 * side.brake, side.name


def test_bad_limits_are_refused(robot):
    with pytest.raises(UnknownNameError, match=r"mode 'bufer'.*buffer"):
        JointLimits(mode="bufer")
    with pytest.raises(InputError, match="buffer must be above 0"):
        JointLimits(0.0)
    with pytest.raises(InputError, match="brake_acceleration"):
        JointLimits(brake_acceleration=-1.0)
    with pytest.raises(InputError, match=r"joint limits of 'joint1' must be \(lower, upper\)"):
        JointLimits(joints={"joint1": (1.0, 0.0)})
    with pytest.raises(InputError, match=r"speeds must be given by joint name, got 1\.5"):
        JointLimits(speeds=1.5)
    with pytest.raises(InputError, match="joints must be given by joint name"):
        JointLimits(joints=[(0.0, 1.0)])
    with pytest.raises(UnknownNameError, match=r"joint 'joint7'.*joint6"):
        Controller(robot, Stack([JointLimits(joints={"joint7": (0.0, 1.0)})]))


def test_stiff_tasks_do_not_wake_limits_that_are_far_away(robot):
    """With a wide margin, limits 0.2 rad away came and went with every tick at kp = 2500/s²."""
    robot.update(robot.q_reference, np.zeros(6))
    here = robot.position(robot.frame_id("tool")).copy()
    target = MinimumJerk(here, here + [0.6, 0.0, 0.0], 1.5, start_time=0.2)
    position = PositionTask(target=target, kp=2500.0)
    posture = PostureTask(robot.q_reference)
    controller = Controller(robot, Stack([JointLimits(), OrientationTask(), position, posture]))
    plant = Plant(robot, robot.q_reference, torque_limits=False)
    torques, awake = [], []

    class Watch:
        def observe(self, q, v, command):
            torques.append(command.tau)
            awake.append(bool(command.limits))

    simulate(plant, controller, 2.6, [Watch()])
    assert np.count_nonzero(np.diff(awake)) <= 2
    assert np.max(np.abs(np.diff(torques, axis=0))) < 15.0
    assert np.max(np.abs(plant.v)) < 1e-3


def test_a_joint_that_starts_outside_comes_back_and_stays(robot):
    q = robot.q_reference.copy()
    limits = JointLimits(joints={"joint1": (q[0] - 1.0, q[0] - 0.3), "joint3": (q[2] + 0.2, 0.0)})
    controller = Controller(robot, Stack([limits, PostureTask(q)]))
    plant = Plant(robot, q, torque_limits=False)
    path = []

    class Watch:
        def observe(self, q, v, command):
            path.append(q[[0, 2]])

    simulate(plant, controller, 2.0, [Watch()])
    first, third = np.array(path).T
    assert np.all(np.diff(first[5:]) <= 1e-6)  # inwards all the way, no swinging about the limit
    assert first[-1] == pytest.approx(q[0] - 0.3, abs=1e-3)
    assert third[-1] == pytest.approx(q[2] + 0.2, abs=1e-3)


def test_a_misspelt_profile_is_found_before_the_first_tick(robot):
    with pytest.raises(UnknownNameError, match=r"profile 'quintc'.*quintic"):
        Controller(robot, Stack([JointLimits(profile="quintc"), PostureTask()]))


class Gentle(JointLimits):
    """Never more than 1 rad/s² towards a limit."""

    def admissible(self, side, position, speed):
        return min(super().admissible(side, position, speed), 1.0)


class Early(JointLimits):
    """Takes part as a task set with all it has, always."""

    def presence(self, side, position, speed):
        return 1.0


class Wide(JointLimits):
    def margin(self, side):
        return 5.0 * side.brake


@pytest.mark.parametrize("kind", [Gentle, Early, Wide])
@pytest.mark.parametrize("form", [Controller, ReferenceController])
def test_a_law_of_ones_own_is_honoured_in_both_forms(robot, kind, form):
    """A subclass gives what the readable form with its law gives, and not what the built-in does."""
    rng = np.random.default_rng(3)
    q = robot.q_reference + rng.uniform(-0.2, 0.2, 6)
    v = rng.uniform(-0.5, 0.5, 6)
    target = robot.fresh()
    target.update(q, v)
    wanted = target.position(target.frame_id("tool")) + [0.3, 0.1, -0.2]

    def torque(limits, form):
        position = PositionTask(kp=400.0, target=wanted)
        stack = Stack([limits, OrientationTask(), position, PostureTask()])
        controller = form(load_robot("puma560"), stack)
        return [controller.step(0.001 * i, q, v * np.cos(i)).tau for i in range(3)]

    found = torque(kind(), form)
    np.testing.assert_allclose(found, torque(kind(), ReferenceController), rtol=0, atol=1e-9)
    if kind is Gentle:
        assert np.max(np.abs(np.subtract(found, torque(JointLimits(), form)))) > 1.0


def test_a_batch_refuses_a_law_of_ones_own_by_name(robot):
    controller = Controller(robot, Stack([Gentle(), PostureTask(np.zeros(6))]))
    with pytest.raises(InputError, match="Gentle"):
        controller.torque_batch(np.zeros((2, 6)), np.zeros((2, 6)))
