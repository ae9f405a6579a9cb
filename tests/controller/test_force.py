"""Forces and impedances in a tick: what the world answers, what other tasks see, both forms alike."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace import Status
from opspace.controller import ReferenceController
from opspace.errors import InputError, UnknownNameError
from opspace.tasks.task import Task, TaskTerms
from tests.controller.test_compiled import assert_same
from tests.stack.arm import state

DT = 1e-3
KINDS = pytest.mark.parametrize("kind", [osc.Controller, ReferenceController])
ROBOT = osc.load_robot("puma560")
TOOL = ROBOT.tool


def on_environment(robot, force):
    """A force along the tool's z axis, as the controller is told it."""
    return np.concatenate([robot.rotation(robot.frame_id(TOOL)) @ [0.0, 0.0, force], np.zeros(3)])


def in_contact(press, q, v, force, ticks=400):
    """Let a force task feel a force until it is sure of the contact; the time of the tick after."""
    robot = placed(q, v)
    press.bind(robot)
    for i in range(ticks):
        press.take(i * DT, on_environment(robot, force))
        press.sense(robot, i * DT)
    return ticks * DT


def placed(q, v):
    robot = ROBOT.fresh()
    robot.update(q, v)
    return robot


def answer(q, v, tau, rows, drift):
    """Force on the world and acceleration when rigid contact stops the rows (m, n)."""
    robot = placed(q, v)
    free = np.linalg.solve(robot.M, tau - robot.bias)
    across = np.linalg.solve(robot.M, rows.T)
    force = np.linalg.solve(rows @ across, rows @ free + drift)
    return force, free - across @ force


@settings(max_examples=6)
@given(st.integers(0, 2**32 - 1), st.floats(5.0, 40.0), st.sampled_from([0, 1, 2]))
def test_a_rigid_surface_gets_the_force_and_no_other_task_sees_it(seed, force, level):
    q, v = state(ROBOT, seed)
    v = 0.0 * v
    press = osc.ForceTask(force=force, ki=0.0, friction=False)
    others = [osc.OrientationTask(), osc.PositionTask(axes="xy", axes_frame="tool")]
    stack = [*others[:level], press, *others[level:], osc.PostureTask(ROBOT.q_reference)]
    controller = ReferenceController(ROBOT.fresh(), osc.Stack(stack), singularity=None)
    t = in_contact(press, q, v, force)
    wrenches = {TOOL: on_environment(placed(q, v), force)}
    command = controller.step(t, q, v, wrenches=wrenches)
    terms = press.evaluate(controller.robot, t)
    exerted, acceleration = answer(q, v, command.tau, terms.J, terms.drift)
    assert press.touch.confidence > 1.0 - 1e-15
    assert exerted[0] == pytest.approx(force, rel=1e-10)
    alone = ReferenceController(
        ROBOT.fresh(),
        osc.Stack([Stopped(terms) if task is press else task for task in stack]),
        singularity=None,
    )
    free = np.linalg.solve(controller.robot.M, alone.step(t, q, v).tau - controller.robot.bias)
    np.testing.assert_allclose(acceleration, free, atol=1e-10 * max(1.0, np.max(np.abs(free))))


class Stopped(Task):
    """Rows that a rigid surface would stop."""

    def __init__(self, terms: TaskTerms) -> None:
        super().__init__("stopped", rows=1, units=("m",))
        self._terms = terms

    def bind(self, robot):
        pass

    def evaluate(self, robot, t):
        return TaskTerms(self._terms.J, self._terms.drift, np.zeros(1), np.zeros(1))


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.floats(50.0, 5000.0), st.booleans())
def test_an_impedance_rests_where_its_spring_holds_the_push(seed, stiffness, top):
    q, _ = state(ROBOT, seed)
    v = np.zeros(ROBOT.nv)
    rng = np.random.default_rng(seed)
    robot = placed(q, v)
    push = rng.uniform(-20.0, 20.0, 3)
    here = robot.position(robot.frame_id(TOOL))
    spring = osc.ImpedanceTask(target=here - push / stiffness, stiffness=stiffness)
    turn = osc.OrientationTask(kp=30.0)
    tasks = [spring, turn] if top else [turn, spring]
    controller = ReferenceController(robot, osc.Stack(tasks), singularity=None)
    tau = controller.step(0.0, q, v).tau
    J = robot.jacobian(robot.frame_id(TOOL))[:3]
    acceleration = J @ np.linalg.solve(robot.M, tau - robot.bias + J.T @ push)
    size = np.max(np.abs(J @ np.linalg.solve(robot.M, J.T @ push)))
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-10 * max(1.0, size))


@given(
    st.floats(1.0, 200.0), st.floats(0.0, 2.0), st.floats(0.0, 1.2),
    st.floats(0.1, 50.0), st.floats(1.0, 7.0),
)  # fmt: skip
def test_gains_that_are_taken_are_stable_on_every_surface(kv, kp, part, mass, decades):
    """Routh: m s³ + m kv s² + k (1 + kp) s + k ki is stable if and only if ki < kv (1 + kp)."""
    k, ki = 10.0**decades, part * kv * (1.0 + kp)
    stable = bool(
        np.all(np.roots([1.0, kv, k / mass * (1.0 + kp), k / mass * ki]).real < 1e-9 * kv)
    )
    assert stable == (part < 1.0) or part == pytest.approx(1.0, abs=1e-6) or part < 1e-6
    if part <= 0.5:
        osc.ForceTask(kv=kv, kp=kp, ki=ki * (1.0 - 1e-12))
    elif part > 0.5 + 1e-9:
        with pytest.raises(InputError, match="not stable on every surface"):
            osc.ForceTask(kv=kv, kp=kp, ki=ki)


@given(
    st.floats(1.0, 200.0), st.floats(0.0, 2.0), st.floats(0.1, 50.0), st.floats(1.0, 7.0)
)  # fmt: skip
def test_the_limit_of_the_loop_is_the_damping_whatever_is_touched(kv, kp, mass, decades):
    """At ki = kv (1 + kp) a root lies on the axis, at the frequency √(k (1 + kp)/m) of the spring."""
    k, ki = 10.0**decades, kv * (1.0 + kp)
    s = 1j * math.sqrt(k * (1.0 + kp) / mass)
    terms = np.array([mass * s**3, mass * kv * s**2, k * (1.0 + kp) * s, k * ki])
    assert abs(np.sum(terms)) <= 1e-10 * np.max(np.abs(terms))
    # There the open loop is -1, for every stiffness and mass.
    loop = k * (1.0 + kp) * (s + ki / (1.0 + kp)) / (mass * s**2 * (s + kv))
    assert loop == pytest.approx(-1.0, rel=1e-10)


def test_gains_that_would_not_hold_are_refused_later_too():
    press = osc.ForceTask(kv=40.0, ki=8.0)
    for name, value in (("kv", 10.0), ("kv", None), ("kv", 0.0), ("ki", 30.0)):
        with pytest.raises(InputError):
            setattr(press, name, value)
    assert (press.kv, press.ki) == (40.0, 8.0)
    press.kv = 20.0
    assert press.kv == 20.0


class Pushing(osc.PositionTask):
    """A position task of one's own that carries a torque."""

    carried: np.ndarray | None = None

    def evaluate(self, robot, t):
        terms = super().evaluate(robot, t)
        return TaskTerms(terms.J, terms.drift, terms.acceleration, terms.error, self.carried)


@KINDS
@pytest.mark.parametrize("torque_limits", ["report", "priority"])
def test_a_torque_of_zero_changes_no_bit(kind, torque_limits):
    found = []
    for carried in (None, np.zeros(ROBOT.nv)):
        task = Pushing()
        task.carried = carried
        stack = osc.Stack([osc.JointLimits(), task, osc.PostureTask(ROBOT.q_reference)])
        controller = kind(ROBOT.fresh(), stack, torque_limits=torque_limits, period=DT)
        found.append([controller.step(i * DT, *state(ROBOT, i)).tau for i in range(5)])
    np.testing.assert_array_equal(*found)


@KINDS
@pytest.mark.parametrize("carried", [np.full(6, np.nan), np.zeros(5)])
def test_a_torque_that_cannot_be_used_is_refused(kind, carried):
    task = Pushing()
    task.carried = carried
    controller = kind(ROBOT.fresh(), osc.Stack([task]))
    with pytest.raises(InputError, match="position"):
        controller.step(0.0, *state(ROBOT))


def pressing_stack(**options):
    press = osc.ForceTask(force=8.0, moment_axes="xy", approach_speed=0.03, **options)
    press.activation = osc.ActivationUnion(
        osc.Contact(press), osc.DistanceBuffer([0.3, 0.0, 0.2], off=0.5, on=0.2)
    )
    hand = osc.PositionTask(name="hand")
    return press, [osc.JointLimits(), press, osc.OrientationTask(), hand, osc.PostureTask()]


@pytest.mark.parametrize("blending", ["auto", "idv", "chain"])
@pytest.mark.parametrize(
    "options",
    [{}, {"torque_limits": "priority", "period": DT}, {"bias": "task"}],
    ids=["plain", "limits", "task bias"],
)
def test_the_compiled_form_is_the_readable_one(blending, options):
    runs = []
    for kind in (osc.Controller, ReferenceController):
        press, tasks = pressing_stack()
        stack = osc.Stack(tasks)
        controller = kind(ROBOT.fresh(), stack, blending=blending, **options)
        commands, touches = [], []
        for i in range(60):
            q, v = state(ROBOT, 3)
            q = q + 1e-3 * i * v
            force = 400.0 if i in (20, 21) else 0.4 * i
            wrench = on_environment(placed(q, v), force) + [1.0, -0.5, 0.0, 0.1, 0.0, 0.2]
            if i == 30:
                stack.swap("orientation", "hand", duration=0.05)
            given = None if 40 <= i < 55 else wrench
            commands.append(controller.step(i * DT, q, v, wrenches={TOOL: given}))
            touches.append(press.touch)
        runs.append((commands, touches))
    (ours, felt), (readable, known) = runs
    for a, b, touch, same in zip(ours, readable, felt, known, strict=True):
        assert_same(a, b)
        np.testing.assert_allclose(touch.commanded, same.commanded, atol=1e-9)
    assert any(Status.WRENCH_STALE & command.status for command in ours)
    assert any(0.01 < touch.confidence < 0.99 for touch in felt)


def test_motors_that_cannot_give_the_force_give_part_of_it_and_say_so():
    for kind in (osc.Controller, ReferenceController):
        press = osc.ForceTask(force=3000.0, contact=(1.0, 4.0))
        controller = kind(
            ROBOT.fresh(), osc.Stack([press, osc.PostureTask()]), torque_limits="priority"
        )
        q, v = ROBOT.q_reference, np.zeros(ROBOT.nv)
        t = in_contact(press, q, v, 50.0)
        command = controller.step(t, q, v, wrenches={TOOL: on_environment(placed(q, v), 50.0)})
        assert command.status & Status.TORQUE_SCALED
        assert np.all(np.abs(command.tau) <= ROBOT.torque_limit * (1.0 + 1e-9))


@KINDS
def test_a_wrench_that_is_missing_is_an_error_by_name(kind):
    controller = kind(ROBOT.fresh(), osc.Stack([osc.ForceTask(name="press")]))
    q, v = state(ROBOT)
    with pytest.raises(InputError, match=f"'press' needs the wrench of '{TOOL}'"):
        controller.step(0.0, q, v)
    with pytest.raises(InputError, match="never been measured"):
        controller.step(0.0, q, v, wrenches={TOOL: None})
    with pytest.raises(UnknownNameError, match="nowhere"):
        controller.step(0.0, q, v, wrenches={"nowhere": np.zeros(6), TOOL: np.zeros(6)})
    with pytest.raises(InputError, match="finite"):
        controller.step(0.0, q, v, wrenches={TOOL: np.full(6, np.nan)})
    command = controller.step(0.0, q, v, wrenches={TOOL: np.zeros(6)})
    assert command.status == Status.OK


@KINDS
@pytest.mark.parametrize(
    "given",
    [
        np.zeros((6, 1)), np.zeros(5), np.float64(1.0), np.full(6, np.inf), ["a"] * 6,
        np.array([0.0, 0.0, 0.0, 0.0, np.inf, -np.inf]),
    ],
    ids=["column", "five", "number", "inf", "words", "cancelling"],
)  # fmt: skip
def test_a_wrench_of_the_running_tick_that_is_none_is_refused_and_leaves_nothing(kind, given):
    """The second tick takes the short way, in which nothing may be let through either."""
    press = osc.ForceTask(name="press")
    controller = kind(ROBOT.fresh(), osc.Stack([press]))
    q, v = state(ROBOT)
    good = on_environment(placed(q, v), 3.0)
    for i in range(3):
        controller.step(i * DT, q, v, wrenches={TOOL: good})
    before = press.memory.row.copy()
    with pytest.raises(InputError, match="wrench"):
        controller.step(3 * DT, q, v, wrenches={TOOL: given})
    np.testing.assert_array_equal(press.memory.row, before)
    np.testing.assert_array_equal(controller.wrenches[TOOL], good)


@KINDS
def test_what_was_given_is_told_whatever_joins_before_a_wrench_is_refused(kind):
    controller = kind(ROBOT.fresh(), osc.Stack([osc.ForceTask(name="press"), osc.PostureTask()]))
    q, v = state(ROBOT)
    good = on_environment(placed(q, v), 3.0)
    for i in range(3):
        controller.step(i * DT, q, v, wrenches={TOOL: good})
    controller.stack.insert(osc.ForceTask(name="other"), level=0, duration=0.1)
    with pytest.raises(InputError, match="wrench"):
        controller.step(3 * DT, q, v, wrenches={TOOL: np.full(6, np.nan)})
    np.testing.assert_array_equal(controller.wrenches[TOOL], good)


@pytest.mark.parametrize(
    "as_given",
    [
        lambda w: w, list, lambda w: w.astype(np.float32), lambda w: w.astype(">f8"),
        lambda w: np.repeat(w, 2)[::2], lambda w: w.astype(int),
    ],
    ids=["array", "list", "single", "big-endian", "every second", "whole"],
)  # fmt: skip
def test_a_wrench_counts_in_whatever_form_it_is_given(as_given):
    """Numbers that all these forms can hold, so that the torque is the same to the last bit."""
    q, v = state(ROBOT)
    taus = []
    for form in (lambda w: w, as_given):
        controller = osc.Controller(ROBOT.fresh(), osc.Stack([osc.ForceTask(), osc.PostureTask()]))
        for i in range(4):
            given = np.array([1.0, -2.0, 3.0 + i, 0.0, 1.0, 0.0])
            tau = controller.step(i * DT, q, v, wrenches={TOOL: form(given)}).tau
            np.testing.assert_array_equal(controller.wrenches[TOOL], given)
        taus.append(tau)
    np.testing.assert_array_equal(*taus)


@KINDS
def test_a_stale_wrench_is_reported_and_the_arm_presses_on_with_what_it_commanded(kind):
    press = osc.ForceTask(force=10.0)
    controller = kind(ROBOT.fresh(), osc.Stack([press, osc.PostureTask()]))
    q, v = state(ROBOT, 1)[0], np.zeros(ROBOT.nv)
    t = in_contact(press, q, v, 9.0)
    before = press.touch
    stale = [controller.step(t + i * DT, q, v, wrenches={TOOL: None}) for i in range(30)]
    assert [bool(s.status & Status.WRENCH_STALE) for s in stale] == [i > 9 for i in range(30)]
    settled = press.touch
    assert settled.confidence == pytest.approx(before.confidence, abs=0.01)
    np.testing.assert_allclose(stale[-1].tau, stale[15].tau, rtol=0, atol=1e-9)


@KINDS
def test_no_wrench_is_needed_where_no_task_presses(kind):
    press = osc.ForceTask(force=10.0)
    stack = osc.Stack([osc.PositionTask(), osc.PostureTask()])
    controller = kind(ROBOT.fresh(), stack)
    q, v = state(ROBOT)
    controller.step(0.0, q, v)
    stack.insert(press, level=0, duration=0.1)
    with pytest.raises(InputError, match="needs the wrench"):
        controller.step(DT, q, v)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"force": 3.0, "contact": (1.0, 4.0)}, "half-way"),
        ({"force": 0.0}, "zero"),
        ({"contact": (4.0, 1.0)}, "0 < off < on"),
        ({"axes": "q"}, "xyz"),
        ({"force": [1.0, 2.0]}, "shape"),
        ({"axes_frame": "elbow"}, "axes_frame"),
        ({"kv": 0.0}, "above zero"),
        ({"reach": 0.0}, "reach"),
    ],
)
def test_a_force_task_that_could_not_work_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        osc.ForceTask(**options)
