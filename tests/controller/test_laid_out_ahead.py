"""Plans made in the thread that asks, and changes between both forms of the tick."""

import numpy as np
import pytest
from hypothesis import given, settings

import opspace as osc
from opspace.controller import Controller
from opspace.plan.plan import Plan
from opspace.stack import Stack
from opspace.tasks import JointLimits, JointTask, OrientationTask, PositionTask, PostureTask
from tests.stack.arm import arm, state, tasks_for
from tests.stack.programs import Program, programs, running_of

DT = 0.002


@pytest.fixture(scope="module")
def robot():
    return arm()


class InTheTick(Controller):
    """Lays out every stack in the tick that needs it."""

    def _lay_out_ahead(self, to_come):
        del to_come


def played(kind, robot, steps, ticks):
    tasks = tasks_for(robot)
    tasks[1].target = None  # it holds what it finds, each time it comes
    stack = Stack([tasks[0], [tasks[2], tasks[3]], tasks[6]], JointLimits())
    levels = {t.name: n for n, level in stack.levels_by_number.items() for t in level}
    controller = kind(robot.fresh(), stack)
    controller.warm_up()
    program = Program(stack, tasks, steps, levels, overlap=4)
    rng = np.random.default_rng(1)
    found = []
    q, v = state(robot)
    for tick in range(ticks):
        t = tick * DT
        members = stack.members
        program.play(tick, {m.task.name for m in members}, running_of(members, t))
        if tick % 37 == 5:
            tasks[tick % 7].kp = rng.uniform(10.0, 50.0)
        q = q + rng.uniform(-2e-3, 2e-3, q.size)
        command = controller.step(t, q, v)
        tasks_then = {n: (s.activation, s.levels) for n, s in command.tasks.items()}
        found.append((command.tau.tobytes(), command.status, command.hard_solves, tasks_then))
    return found


@settings(max_examples=15, deadline=None)
@given(steps=programs(0.01, 0.2))
def test_plans_made_ahead_give_the_same_to_the_last_bit(robot, steps):
    ahead, in_the_tick = (played(kind, robot, steps, 200) for kind in (Controller, InTheTick))
    assert ahead == in_the_tick


TWICE = {
    "a move on from a move": (
        lambda s, t: s.move(t[0], 0.5, 0.05),
        lambda s, t: s.move(t[0], 2.0, 0.03, profile="tanh"),
    ),
    "a removal turned around": (
        lambda s, t: s.remove(t[0], 0.05, profile="half-sine"),
        lambda s, t: s.insert(t[0], 0.0, 0.02),
    ),
    "a hard switch on the way": (
        lambda s, t: s.swap(t[0], t[6], 0.05),
        lambda s, t: (s.remove(t[0], 0.0), s.insert(t[0], 3.0, 0.04)),
    ),
    "starts between two ticks": (
        lambda s, t: s.insert(t[1], 0.5, 0.02),
        lambda s, t: (
            s.move(t[1], 4.0, 0.01, start_time=0.0127),
            s.remove(t[1], start_time=0.0131),
        ),
    ),
}


@pytest.mark.parametrize("first", TWICE)
@pytest.mark.parametrize("apart", [0, 1, 2, 7, 40])
def test_what_is_foreseen_is_what_happens(robot, first, apart):
    found = []
    for kind in (Controller, InTheTick):
        tasks = tasks_for(robot)
        stack = Stack([tasks[0], tasks[6]])
        controller = kind(robot.fresh(), stack)
        controller.warm_up()
        q, v = state(robot)
        taus = []
        for k in range(120):
            for ask in [TWICE[first][0]] * (k == 2) + [TWICE[first][1]] * (k == 2 + apart):
                ask(stack, tasks)
            taus.append(controller.step(k * DT + 1e-4 * (k % 3), q, v).tau.tobytes())
        found.append((taus, repr(stack)))
    assert found[0] == found[1]


def test_no_tick_lays_out_a_stack_that_could_be_foreseen(robot, monkeypatch):
    tasks = tasks_for(robot)
    stack = Stack([tasks[0], tasks[6]])
    stack.insert(tasks[2], 0.5, 0.05, start_time=0.5)
    controller = Controller(robot.fresh(), stack)
    controller.warm_up()
    q, v = state(robot)
    made = []
    planned = controller._planned
    monkeypatch.setattr(controller, "_planned", lambda *given: made.append(1) or planned(*given))
    requests = {
        10: lambda: stack.insert(tasks[1], 1.5, 0.1),
        30: lambda: stack.move(tasks[1], -1.0, 0.1),
        45: lambda: stack.swap(tasks[0], tasks[6], 0.1),
        150: lambda: stack.remove(tasks[1], 0.1),
        170: lambda: stack.insert(tasks[1], -1.0, 0.1),
        180: lambda: stack.remove(tasks[1], 0.1),
    }
    for k in range(400):
        if k in requests:
            requests[k]()
        before = len(made)
        controller.step(k * DT, q, v)
        assert len(made) == before
    assert stack.settled
    assert made


def test_looking_ahead_touches_no_task_and_no_ramp(robot):
    tasks = tasks_for(robot)
    tasks[2].target = None
    stack = Stack([tasks[2], tasks[6]])
    controller = Controller(robot.fresh(), stack)
    q, v = state(robot)
    controller.step(0.0, q, v)
    held, ramp = tasks[2]._held, stack.members[0].presence.ramp
    stack.remove(tasks[2], 0.1, start_time=1.0)
    stack.insert(tasks[2], 0.0, 0.1, start_time=2.0)
    assert tasks[2]._held is held
    assert stack.members[0].presence.ramp is ramp


def test_the_end_of_an_insertion_keeps_the_tasks_as_they_are(robot):
    tasks = tasks_for(robot)
    stack = Stack([tasks[0], tasks[6]])
    controller = Controller(robot.fresh(), stack)
    q, v = state(robot)
    controller.step(0.0, q, v)
    stack.insert(tasks[1], 1.0, 0.1)
    controller.step(DT, q, v)
    members = stack.members
    controller.step(0.5, q, v)
    assert stack.settled
    assert stack.members is members


def largest_step(dt, robot):
    """Five removals under way when one place more than the compiled tick takes is asked for."""
    tasks = tasks_for(robot)
    moving = [tasks[k] for k in (0, 1, 2, 3, 4)]
    joints = robot.joint_names
    far = [JointTask(joints[i % 6], 0.3, name=f"far {i}") for i in range(25)]
    levels = {0.1 * k: task for k, task in enumerate(moving)}
    stack = Stack({**levels, 1.0: PostureTask(robot.q_reference + 0.2), 2.0: far})
    controller = Controller(robot.fresh(), stack)
    for i, k in enumerate((4, 3, 2, 1, 0)):  # in another order than that of the list
        stack.remove(moving[k], 0.4, start_time=0.01 + 0.02 * i)
    stack.move(far[0], 3.0, 0.1, start_time=0.2)
    q, v = state(robot)
    forms, taus = [], []
    for k in range(round(0.22 / dt)):
        taus.append(controller.step(k * dt, q, v).tau)
        forms.append(Plan.fits(stack.members))
    assert forms[0]
    assert not forms[-1]
    return np.abs(np.diff(taus, axis=0)).max()


def test_the_groups_of_the_blend_go_along_between_both_forms(robot):
    assert largest_step(5e-4, robot) < 0.4 * largest_step(2e-3, robot)


def test_which_way_a_rotation_went_goes_along_between_both_forms():
    robot = osc.load_robot("puma560")
    hand = OrientationTask(name="hand")
    fill = [JointTask("joint1", 0.1, name=f"far {i}") for i in range(30)]
    stack = Stack({0.0: hand, 2.0: fill})
    controller = Controller(robot, stack)
    q, v = robot.q_reference.copy(), np.zeros(6)
    controller.step(0.0, q, v)
    stack.insert(PositionTask(name="one", target=[0.4, 0.1, 0.3]), 3.0, 0.1, start_time=0.7)
    stack.remove("one", 0.1, start_time=1.0)
    errors = []
    # Past half a turn with the compiled tick, on with the readable one, and back.
    q[5] += 3.0
    for k in range(150):
        q[5] = robot.q_reference[5] + min(3.0, 0.05 * k) + 0.25 * min(k / 70.0, 1.0)
        command = controller.step(0.01 * (k + 1), q, v)
        errors.append(float(np.linalg.norm(command.tasks["hand"].error)))
    assert max(errors) > np.pi + 0.05
    assert np.abs(np.diff(errors)).max() < 0.1
