"""Tasks that come, go and change rank while the controller runs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.controller import Controller, ReferenceController
from opspace.errors import InputError, UnknownNameError
from opspace.law import TaskSet, Weighted, blended_torque, corners
from opspace.plan.scales import Singularity
from opspace.robots import load_robot
from opspace.stack import Stack, mixture
from opspace.tasks import (
    ActivationProduct,
    DistanceBuffer,
    JointBuffer,
    JointLimits,
    JointTask,
    OrientationTask,
    PositionTask,
    PostureTask,
)
from tests.stack.arm import arm, state, tasks_for
from tests.stack.programs import Program, programs, running_of, variables_of

DT = 0.002


@pytest.fixture(scope="module")
def robot():
    return arm()


def named(tasks):
    return {task.name: task for task in tasks}


def initial_levels(stack):
    return {t.name: n for n, level in stack.levels_by_number.items() for t in level}


def fresh_torque(robot, levels, q, v, **options):
    """Torque of a controller that is built with the tasks of ``levels`` from the start."""
    tasks = named(tasks_for(robot))
    rows = [
        [tasks[name] for name, level in levels.items() if level == number]
        for number in sorted(set(levels.values()))
    ]
    return Controller(robot.fresh(), Stack(rows), **options).step(0.0, q, v).tau


def hard_torques(controller, stacks, t):
    """Torque of every stack of (task, level) pairs at the robot's present state, without bias."""
    robot, scales = controller.robot, controller._scales
    L = np.linalg.cholesky(robot.M)
    terms = {task: task.evaluate(robot, t) for stack in stacks for task, _ in stack}
    result = {}
    for stack in stacks:
        rank = {level: k for k, level in enumerate(sorted({level for _, level in stack}))}
        sets = [
            TaskSet(
                terms[task].J,
                terms[task].acceleration - terms[task].drift,
                rank[level],
                sigma_reference=scales.reference(task),
            )
            for task, level in sorted(stack, key=lambda pair: (pair[1], pair[0].name))
        ]
        motion = L.T @ robot.v
        rest = -controller.damping * motion
        sets.append(TaskSet(L.T, rest, len(rank), sigma_reference=scales.unit))
        everything = [Weighted(1.0, frozenset(range(len(sets))))]
        result[stack] = blended_torque(L, sets, everything, scales.buffer, motion=motion)[0]
    return result


def blend_of(controller, t):
    """Stacks of (task, level) pairs and their weights at time t, and every moving activation."""
    members = controller.stack.transitions.ticked
    presences = [m.presence.value(t) for m in members]
    mixed = mixture(members, presences, t, controller._blending)
    stacks = {
        frozenset((members[mixed.slots[k].member].task, mixed.slots[k].level) for k in present): w
        for w, present in mixed.corners
    }
    return stacks, {v: v.value(t) for v in variables_of(members)}


class StepBound:
    """|Δτ| <= Σ |Δ activation| · widest gap of hard torques + what the state changes in them."""

    def __init__(self, controller):
        self.controller, self.tau = controller, None

    def observe(self, q, v, command):
        controller, t = self.controller, command.t
        stacks, values = blend_of(controller, t)
        tau = command.tau - controller.robot.bias
        before = {} if self.tau is None else self.stacks
        hard = hard_torques(controller, [*stacks, *before], t)
        np.testing.assert_allclose(
            tau, sum(w * hard[s] for s, w in stacks.items()), rtol=0, atol=1e-8
        )
        if self.tau is not None:
            moved = sum(
                abs(one.value(t) - self.values.get(one, 0.0)) for one in {*values, *self.values}
            )
            gap = np.ptp(list(hard.values()), axis=0).max()
            drift = sum(w * np.abs(hard[s] - self.hard[s]).max() for s, w in before.items())
            step = np.abs(tau - self.tau).max()
            assert step <= moved * gap + drift + 1e-8
        self.tau, self.stacks, self.values, self.hard = tau, stacks, values, hard


def play(robot, steps, blending, ticks, advance, observer=None):
    """Run a program on a controller; ``advance`` gives the state of every tick."""
    tasks = tasks_for(robot)
    stack = Stack([tasks[0], [tasks[2], tasks[3]], tasks[6]])
    controller = Controller(robot, stack, blending=blending)
    program = Program(stack, tasks, steps, initial_levels(stack), overlap=4)
    watching = None if observer is None else observer(controller)
    q, v = advance(None)
    for tick in range(ticks):
        t = tick * DT
        members = stack.transitions.ticked
        program.play(tick, {m.task.name for m in members}, running_of(members, t))
        command = controller.step(t, q, v)
        if watching is not None:
            watching.observe(q, v, command)
        q, v = advance(command.tau)
    assert program.done
    assert stack.settled
    return controller, program, command


@pytest.mark.parametrize("blending", ["auto", "idv", "chain", "smooth-chain"])
@settings(max_examples=4)
@given(steps=programs(0.02, 0.1, (4, 8)))
def test_what_is_left_is_what_a_fresh_stack_gives(robot, blending, steps):
    q, v = state(robot)
    controller, program, command = play(robot, steps, blending, 160, lambda _: (q, v))
    assert initial_levels(controller.stack) == program.levels
    assert command.hard_solves == 1
    expected = fresh_torque(robot, program.levels, q, v, blending=blending)
    scale = max(1.0, np.abs(expected).max())
    np.testing.assert_allclose(command.tau, expected, rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("blending", ["auto", "idv", "chain"])
@settings(max_examples=2)
@given(steps=programs(0.02, 0.1, (4, 6)))
def test_in_motion_only_the_state_adds_to_the_steps(robot, blending, steps):
    """A robot that obeys: the command's own acceleration, integrated."""
    q, v = state(robot)

    def advance(tau):
        nonlocal q, v
        if tau is not None:
            v = v + DT * np.linalg.solve(robot.M, tau - robot.bias)
            q = robot.integrate(q, v, DT)
        return q, v

    play(robot, steps, blending, 130, advance, StepBound)


def test_eight_transitions_at_once_make_nine_hard_solves(robot):
    tasks = tasks_for(robot)
    stack = Stack([[tasks[0], tasks[1]], tasks[6]])
    controller = Controller(robot, stack, blending="chain")
    q, v = state(robot)
    controller.step(0.0, q, v)
    for k, task in enumerate(tasks[2:6]):
        stack.insert(task, 0.1 * k, 0.3 + 0.1 * k)
    stack.remove(tasks[0], 0.5)
    stack.move(tasks[1], 2, 0.55)
    for k, name in enumerate(robot.joint_names[1:6:4]):
        stack.insert(JointTask(name, 0.0), 3 + k, 0.35 + 0.1 * k)
    controller.step(0.1, q, v)
    solves = [controller.step(0.1 + s, q, v).hard_solves for s in (0.1, 0.15, 0.2)]
    assert solves == [9, 9, 9]
    assert controller.step(2.0, q, v).hard_solves == 1


def old_torque(controller, levels, q, v):
    """The formula for a stack that never changes, level by level."""
    robot, scales = controller.robot, controller._scales
    robot.update(q, v)
    terms = {task: task.evaluate(robot, 0.0) for level in levels for task in level}
    sets = [
        TaskSet(
            terms[task].J,
            terms[task].acceleration - terms[task].drift,
            priority,
            1.0,
            task.name,
            scales.reference(task),
        )
        for priority, level in enumerate(levels)
        for task in level
    ]
    L = np.linalg.cholesky(robot.M)
    if not any(isinstance(t, PostureTask) and t.rows == robot.nv for t in terms):
        rest = -controller.damping * (L.T @ v)
        sets.append(TaskSet(L.T, rest, len(levels), 1.0, "damping", scales.unit))
    blend = corners([1.0] * len(sets), "idv")
    tau, _ = blended_torque(L, sets, blend, scales.buffer, want_spectra=True, motion=L.T @ v)
    return tau + robot.bias


@settings(max_examples=25)
@given(
    seed=st.integers(0, 2**32 - 1),
    posture=st.booleans(),
    blending=st.sampled_from(["auto", "idv", "chain"]),
)
def test_a_stack_that_does_not_change_gives_the_old_torque_bit_for_bit(
    robot, seed, posture, blending
):
    q, v = state(robot, seed)
    tasks = tasks_for(robot)
    levels = [[tasks[0]], [tasks[1], tasks[2]], *([[tasks[6]]] if posture else [])]
    controller = ReferenceController(robot, Stack(levels), blending=blending)
    tau = controller.step(0.0, q, v).tau
    assert np.array_equal(tau, old_torque(controller, levels, q, v))


def test_a_task_on_its_way_says_where_it_is(robot):
    tasks = tasks_for(robot)
    stack = Stack([tasks[0], tasks[6]])
    controller = Controller(robot, stack)
    q, v = state(robot)
    assert controller.step(0.0, q, v).tasks["height"].levels == ((0.0, 1.0),)
    stack.move("height", 2, 1.0)
    stack.insert(tasks[2], 0.5, 1.0)
    controller.step(0.1, q, v)
    command = controller.step(0.6, q, v)
    assert command.tasks["height"].levels == ((0.0, 0.5), (2.0, 0.5))
    assert command.tasks["height"].activation == 1.0
    assert command.tasks["orientation"].activation == 0.5
    assert command.hard_solves == 4
    assert [level.level for level in command.levels] == [0.0, 0.5, 1.0, 2.0]
    for level in command.levels:
        rows = sum(t.rows for t in tasks if t.name in level.tasks)
        assert level.directions.shape[0] == rows
    after = controller.step(2.0, q, v)
    assert [(level.level, level.tasks) for level in after.levels] == [
        (0.5, ("orientation",)),
        (1.0, ("posture",)),
        (2.0, ("height",)),
    ]
    stack.remove(tasks[2], 0.0)
    assert set(controller.step(2.1, q, v).tasks) == {"height", "posture"}


@pytest.mark.parametrize("scale", ["relative", "absolute"])
def test_calibration_does_not_depend_on_when_a_task_comes(robot, scale):
    singularity = Singularity(scale=scale)
    tasks = tasks_for(robot)
    late = Controller(robot, Stack([tasks[0]]), singularity=singularity)
    q, v = state(robot)
    late.step(0.0, q, v)
    before = robot.q.copy()
    late.stack.insert(tasks[2], 1)
    late.stack.insert(tasks[3], 2)
    assert np.array_equal(robot.q, before)  # a loop in another thread has not lost its state
    others = tasks_for(robot)
    early = Controller(robot, Stack([others[0], others[2], others[3]]), singularity=singularity)
    for k in (0, 2, 3):
        mine, theirs = late._scales.reference(tasks[k]), early._scales.reference(others[k])
        assert np.array_equal(mine, theirs)


def test_a_copy_of_a_robot_has_a_state_of_its_own():
    for backend in ("pinocchio", "mujoco"):
        one = load_robot("puma560", backend=backend)
        other = one.fresh()
        one.update(*state(one, 1))
        M, q = one.M.copy(), one.q.copy()
        other.update(*state(one, 2))
        assert np.array_equal(one.M, M)
        assert np.array_equal(one.q, q)
        assert not np.array_equal(other.M, M)
        other.update(*state(one, 1))
        assert np.array_equal(other.M, M)
        frame = one.frame_id(one.tool)
        assert np.array_equal(other.jacobian(frame), one.jacobian(frame))


def test_damping_does_not_step_when_a_posture_comes(robot):
    """It is always below everything; a posture that covers every joint leaves it nothing."""
    tasks = tasks_for(robot)
    stack = Stack([tasks[0]])
    controller = Controller(robot, stack)
    q, v = state(robot)
    taus = []
    for tick in range(240):
        if tick == 10:
            stack.insert(tasks[6], 1, 0.1)
        if tick == 120:
            stack.remove(tasks[6], 0.1)
        taus.append(controller.step(tick * 0.001, q, v).tau)
    steps = np.abs(np.diff(taus, axis=0)).max(axis=1)
    gap = np.abs(taus[0] - taus[115]).max()
    assert gap > 1.0
    assert 0.9 < steps.max() / (1.875 / 100 * gap) <= 1.0
    np.testing.assert_allclose(taus[-1], taus[0], atol=1e-9)


def test_names_are_looked_up_when_a_task_is_asked_for(robot):
    stack = Stack([PositionTask()])
    stack.insert(PositionTask("flange", name="early"), 1)
    with pytest.raises(UnknownNameError, match=r"'early'.*'flange'"):
        Controller(robot, stack)
    stack = Stack([PositionTask()])
    controller = Controller(robot, stack)
    with pytest.raises(UnknownNameError, match=r"'late'.*'flange'"):
        stack.insert(PositionTask("flange", name="late"), 1)
    wrong = JointTask(robot.joint_names[0], name="wrong")
    wrong.activation = JointBuffer("elbow7", 0.0, 1.0)
    with pytest.raises(UnknownNameError, match="'elbow7'"):
        stack.insert(wrong, 1)
    q, v = state(robot)
    assert set(controller.step(0.0, q, v).tasks) == {"position"}


def test_a_stack_belongs_to_its_last_controller(robot):
    stack = Stack([PositionTask()])
    first, second = Controller(robot, stack), Controller(robot, stack)
    q, v = state(robot)
    stack.insert(OrientationTask(), 1)
    second.step(0.0, q, v)
    with pytest.raises(InputError, match="'orientation' was not prepared"):
        first.step(0.3, q, v)


def test_an_activation_of_ones_own_multiplies(robot):
    q, v = state(robot)
    height, posture = tasks_for(robot)[0], tasks_for(robot)[6]
    stack = Stack([height, posture])
    controller = Controller(robot, stack)
    taus = {}
    for h in (0.0, 0.25, 1.0):
        height.activation = lambda robot, t, h=h: h
        command = controller.step(0.0, q, v)
        assert command.tasks["height"].activation == h
        taus[h] = command.tau
    without = fresh_torque(robot, {"posture": 1.0}, q, v)
    np.testing.assert_allclose(taus[0.0], without, atol=1e-9)
    np.testing.assert_allclose(taus[0.25], 0.75 * taus[0.0] + 0.25 * taus[1.0], atol=1e-9)
    stack.remove(height, 1.0)
    height.activation = lambda robot, t: 0.5
    controller.step(0.0, q, v)
    assert controller.step(0.5, q, v).tasks["height"].activation == pytest.approx(0.25)


@pytest.mark.parametrize("value", [-0.1, 1.5, float("nan"), float("inf")])
def test_an_activation_outside_its_range_is_named_before_any_torque(robot, value):
    task = tasks_for(robot)[0]
    task.activation = lambda robot, t: value if t > 0.0 else 1.0
    controller = Controller(robot, Stack([task]))
    q, v = state(robot)
    controller.step(0.0, q, v)
    with pytest.raises(InputError, match=r"'height': activation at t = 1 s must be in \[0, 1\]"):
        controller.step(1.0, q, v)


def test_ready_made_activations(robot):
    q, v = state(robot)
    robot.update(q, v)
    tool = robot.position(robot.frame_id(robot.tool))
    joint = robot.joint_names[1]
    by_joint = JointBuffer(joint, float(q[1]) - 0.1, float(q[1]) + 0.1)
    near = DistanceBuffer(tool + [0.3, 0.0, 0.4], off=0.75, on=0.25)
    assert by_joint(robot, 0.0) == pytest.approx(0.5)
    assert near(robot, 0.0) == pytest.approx(0.5)
    assert ActivationProduct(by_joint, near)(robot, 0.0) == pytest.approx(0.25)
    assert DistanceBuffer(tool, off=0.2, on=0.1)(robot, 0.0) == 1.0
    with pytest.raises(UnknownNameError, match="'hand7'"):
        ActivationProduct(by_joint, DistanceBuffer(tool, 1, 2, frame="hand7")).bind(robot)


def test_limits_stay_above_a_task_that_is_put_on_top(robot):
    limits = JointLimits(joints={robot.joint_names[0]: (-0.5, 0.1)})
    push = JointTask(robot.joint_names[0], 2.0, name="push")
    stack = Stack([limits, PostureTask(robot.q_reference)])
    controller = Controller(robot, stack)
    q, v = robot.q_reference.copy(), np.zeros(robot.nv)
    q[0] = 0.1
    stack.insert(push, -100, 0.0)
    command = controller.step(0.0, q, v)
    assert command.limits[f"{robot.joint_names[0]}/upper"] == 1.0
    robot.update(q, v)
    assert np.linalg.solve(robot.M, command.tau - robot.bias)[0] == pytest.approx(0.0, abs=1e-8)
