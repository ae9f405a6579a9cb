"""Force and impedance tasks in compiled code compute what the readable form does, come what may."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.controller import Controller, ReferenceController
from opspace.errors import InputError
from opspace.law import press_columns
from opspace.plan.pack_task import OWN, kind_of
from tests.stack.arm import state, tasks_for
from tests.stack.programs import Program, programs, running_of

DT = 1e-3
ROBOT = osc.load_robot("puma560")
TOOL = ROBOT.tool


def pressing_tasks(robot):
    """Seven tasks, of which one presses, one gives way to it, and one is a spring."""
    tasks = tasks_for(robot)
    x = robot.position(robot.frame_id(robot.tool)).copy()
    press = osc.ForceTask(
        force=[3.0, -8.0], axes="xz", moment_axes="y", kv=[30.0, 40.0, 20.0], kp=0.1, name="press",
        offset=[0.0, 0.01, 0.05], axes_frame="tool",
    )  # fmt: skip
    press.activation = osc.ActivationUnion(
        osc.Contact(press), osc.JointBuffer(robot.joint_names[0], off=-1.0, on=3.0)
    )
    hand = osc.PositionTask(target=osc.GiveWay(x, press), name="hand")
    spring = osc.ImpedanceTask(
        target=np.block([[np.eye(3), x[:, None]], [np.zeros(3), 1.0]]), axes_frame="tool",
        stiffness=[300.0, 500.0, 100.0, 20.0, 0.0, 30.0], force=[0, 1.0, -2.0, 0.1, 0, 0],
        name="spring",
    )  # fmt: skip
    tasks[3].activation = osc.Contact(press)
    return [press, hand, spring, *tasks[3:]]


class Touching:
    """A wrench that comes and goes, jumps, is late and is missing, from a seed."""

    def __init__(self, seed):
        self._rng, self._force, self._left = np.random.default_rng(seed), 0.0, 0

    def __call__(self):
        rng = self._rng
        if self._left == 0:
            self._left = int(rng.integers(1, 25))
            self._force = float(rng.choice([0.0, 0.0, 3.0, 9.0, 80.0, np.nan]))
        self._left -= 1
        if np.isnan(self._force):
            return None
        return self._force * np.array([0.3, 0.2, -0.9, 0.02, 0.1, 0.0]) + 0.2 * rng.normal(size=6)


def assert_same_memory(ours, readable):
    np.testing.assert_allclose(ours.memory.row, readable.memory.row, rtol=1e-9, atol=1e-9)


@settings(max_examples=4)
@given(
    steps=programs(0.002, 0.06),
    seed=st.integers(0, 2**32 - 1),
    blending=st.sampled_from(["auto", "idv", "chain"]),
    limits=st.sampled_from(["report", "priority"]),
)
def test_random_programs_while_something_is_touched_and_lost(steps, seed, blending, limits):
    arms = [ROBOT.fresh(), ROBOT.fresh()]
    tasks = [pressing_tasks(arm) for arm in arms]
    stacks = [osc.Stack({0: t[:1], 2: t[6:]}) for t in tasks]
    options = {"blending": blending, "torque_limits": limits, "period": DT}
    ours = Controller(arms[0], stacks[0], **options)
    readable = ReferenceController(arms[1], stacks[1], **options)
    initial = {tasks[0][0].name: 0.0, tasks[0][6].name: 2.0}
    plays = [Program(s, t, steps, initial, overlap=5) for s, t in zip(stacks, tasks, strict=True)]
    q, v = state(arms[0], seed)
    rng, wrench = np.random.default_rng(seed), Touching(seed)
    for k in range(55):
        members = [s.begin_tick(k * DT) for s in stacks]
        for play, present in zip(plays, members, strict=True):
            play.play(k, {m.task.name for m in present}, running_of(present, k * DT))
        if k % 20 == 13:
            x, force = rng.uniform(-0.05, 0.05, 3), rng.uniform(5.0, 20.0)
            for press, hand, spring, *_ in tasks:
                press.force, press.reach = [0.0, -force], 1e-3 * force
                hand.target = osc.GiveWay(x + 0.4, press)
                spring.stiffness, spring.damping_ratio = 20.0 * force, 0.05 * force
        given = wrench() if k else np.zeros(6)
        t = (k + 0.5) * DT
        a, b = (c.step(t, q, v, wrenches={TOOL: given}) for c in (ours, readable))
        scale = max(1.0, float(np.max(np.abs(b.tau))))
        np.testing.assert_allclose(a.tau, b.tau, rtol=0, atol=1e-9 * scale)
        assert a.status == b.status
        for name, task in b.tasks.items():
            np.testing.assert_allclose(a.tasks[name].levels, task.levels, atol=1e-12)
            np.testing.assert_allclose(a.tasks[name].error, task.error, rtol=0, atol=1e-9)
        assert_same_memory(tasks[0][0], tasks[1][0])
        q, v = q + 2e-3 * v, v * np.cos(k * 0.1)


def pressed(kind=Controller, ticks=30, **options):
    """A controller that has pressed on something for some ticks, and its force task."""
    robot = ROBOT.fresh()
    tasks = pressing_tasks(robot)
    controller = kind(robot, osc.Stack([tasks[0], tasks[2], tasks[6]]), period=DT, **options)
    q, v = state(robot, 4)
    wrench = Touching(3)
    for k in range(ticks):
        controller.step(k * DT, q, v, wrenches={TOOL: wrench() if k else np.zeros(6)})
    return controller, tasks[0]


def test_no_python_is_asked_for_them():
    for task in (osc.ForceTask(), osc.ImpedanceTask()):
        task.bind(ROBOT)
        assert kind_of(task) != OWN
    robot = ROBOT.fresh()
    tasks = [osc.ForceTask(force=9.0), osc.PostureTask(ROBOT.q_reference)]
    tasks[1].activation = osc.Contact(tasks[0])
    controller = Controller(robot, osc.Stack(tasks))
    controller.step(0.0, *state(robot), wrenches={TOOL: np.zeros(6)})
    assert not controller._plan.moving

    class Own(osc.ForceTask):
        def evaluate(self, robot, t):
            return super().evaluate(robot, t)

    assert kind_of(Own()) == OWN


def test_a_batch_is_the_next_tick_without_a_new_wrench_and_changes_nothing():
    controller, press = pressed()
    rng = np.random.default_rng(0)
    n = ROBOT.nv
    Q, V = ROBOT.q_reference + rng.uniform(-0.3, 0.3, (4, n)), rng.uniform(-0.5, 0.5, (4, n))
    before, t = press.memory.row.copy(), 30 * DT
    found = controller.torque_batch(Q, V, t)
    np.testing.assert_array_equal(press.memory.row, before)
    for k in range(4):
        again, _ = pressed()
        expected = again.step(t, Q[k], V[k], wrenches={TOOL: None}).tau
        np.testing.assert_allclose(found[k], expected, rtol=0, atol=1e-9 * np.max(np.abs(expected)))


def test_a_batch_needs_a_wrench_that_was_measured():
    controller = Controller(ROBOT.fresh(), osc.Stack([osc.ForceTask(name="press")]))
    with pytest.raises(InputError, match=r"'press'.*never been measured"):
        controller.torque_batch(ROBOT.q_reference[None], np.zeros((1, ROBOT.nv)))


@pytest.mark.parametrize("kind", [Controller, ReferenceController])
def test_a_task_that_is_put_back_begins_without_contact(kind):
    controller, press = pressed(kind)
    press.memory[press_columns.CONFIDENCE] = 0.7
    controller.stack.remove("press", duration=2 * DT)
    q, v = state(controller.robot, 4)
    zero = {TOOL: np.zeros(6)}
    for k in range(30, 40):
        controller.step(k * DT, q, v, wrenches=zero)
    controller.stack.insert(press, level=0, duration=2 * DT)
    controller.step(40 * DT, q, v, wrenches=zero)
    assert press.touch.confidence == 0.0
    assert np.isinf(press.memory[press_columns.FLOOR])


def test_the_form_may_change_while_it_presses():
    """A stack too large for the compiled tick takes the readable one, and comes back."""
    runs = []
    for kind in (Controller, ReferenceController):
        controller, press = pressed(kind)
        q, v = state(controller.robot, 4)
        many = [osc.JointTask(ROBOT.joint_names[0], 0.0, name=f"j{i}") for i in range(30)]
        found = []
        for k in range(30, 45):
            if k == 33:
                for task in many:
                    controller.stack.insert(task, level=9, duration=0.0)
            if k == 38:
                for task in many:
                    controller.stack.remove(task.name, duration=0.0)
            wrench = {TOOL: np.array([0.0, 0.0, -0.2 * k, 0.0, 0.0, 0.0])}
            found.append(controller.step(k * DT, q, v, wrenches=wrench).tau)
        runs.append((np.array(found), press.memory.row.copy()))
    (tau, row), (expected, same) = runs
    np.testing.assert_allclose(tau, expected, rtol=0, atol=1e-9 * np.max(np.abs(expected)))
    np.testing.assert_allclose(row, same, rtol=1e-9, atol=1e-9)


def test_a_task_of_two_controllers_and_a_copy_remember_what_they_should():
    """One memory for a task, wherever it ticks; one of its own for a deep copy."""
    runs = []
    for kind in (Controller, ReferenceController):
        first, press = pressed(kind)
        again = copy.deepcopy(press)
        row = again.memory.row.copy()
        second = kind(ROBOT.fresh(), osc.Stack([press]))
        q, v = state(ROBOT, 4)
        found = []
        for k in range(30, 42):
            controller = (first, second)[k // 3 % 2]
            wrench = {TOOL: np.array([0.0, 0.0, -0.3 * k, 0.0, 0.0, 0.0])}
            found.append(controller.step(k * DT, q, v, wrenches=wrench))
        runs.append(found)
        np.testing.assert_array_equal(again.memory.row, row)
        kept = pickle.loads(pickle.dumps(press.memory))
        np.testing.assert_array_equal(kept.row, press.memory.row)
    for a, b in zip(*runs, strict=True):
        assert a.status == b.status
        np.testing.assert_allclose(a.tau, b.tau, rtol=0, atol=1e-9 * np.max(np.abs(b.tau)))
