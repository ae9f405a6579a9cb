"""How far tasks were from rest lately is remembered, alike in both forms of the tick."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import opspace as osc
from opspace.controller import ReferenceController
from opspace.law.scalars import LONGEST_LESSON, MOST_UNREST, REST_TIME, remembered_unrest
from opspace.plan.plan import Plan

NEAR = osc.Singularity(near=0.3)
KEPT = st.floats(0.0, MOST_UNREST)
NOW = st.floats(0.0, 1e6)
DT = 1e-3


@given(KEPT, NOW, st.floats(-1.0, 1e3))
def test_memory_goes_towards_what_is_and_no_faster_than_its_time_constant(kept, now, passed):
    after = remembered_unrest(kept, now, passed)
    goal = min(now, MOST_UNREST)
    assert min(kept, goal) - 1e-12 <= after <= max(kept, goal) + 1e-12
    part = min(max(passed, 0.0), LONGEST_LESSON) / REST_TIME
    assert abs(after - kept) <= part * MOST_UNREST + 1e-12


@given(KEPT, st.floats(0.0, MOST_UNREST))
def test_memory_is_a_low_pass(kept, now):
    m = kept
    for _ in range(round(REST_TIME / DT)):
        m = remembered_unrest(m, now, DT)
    assert math.isclose(m - now, (kept - now) * math.exp(-1.0), rel_tol=2e-3, abs_tol=1e-12)


def stretched(kind):
    """An arm that reaches almost as far as it can, with a hand's target just before it."""
    robot = osc.load_robot("puma560")
    q = robot.q_reference.copy()
    q[2] = -1.75
    robot.update(q, np.zeros(robot.nv))
    hand = osc.PositionTask(target=robot.position(robot.tool) + [0.01, 0.0, -0.01])
    turn = osc.OrientationTask(target=robot.rotation(robot.tool).copy())
    stack = osc.Stack([turn, hand, osc.PostureTask(robot.q_reference)])
    return q, hand, kind(robot, stack, singularity=NEAR)


def assert_same(ours, other):
    size = max(1.0, np.max(np.abs(other.tau)))
    np.testing.assert_allclose(ours.tau, other.tau, rtol=0, atol=1e-9 * size)
    assert ours.status == other.status


def remembered(controller):
    """What a controller remembers, by the name of the task."""
    plan, unrest = getattr(controller, "_plan", None), controller._rules.unrest
    if plan is not None:
        return {one.task.name: plan.tick.row_unrest[one.rows] for one in plan.packed}
    members = controller.stack.members
    return {m.task.name: unrest.of(m.presence, m.task.rows) for m in members}


def assert_same_memory(compiled, other):
    ours, there = remembered(compiled), other._rules.unrest
    for member in other.stack.members:
        if not isinstance(member.task, osc.JointTask | osc.PostureTask):
            kept = there.of(member.presence, member.task.rows)
            np.testing.assert_allclose(ours[member.task.name], kept, rtol=0, atol=1e-10)


def course(q, count, seed):
    """Slow and quick by turns, about a posture: at rest in between, but never for long."""
    rng = np.random.default_rng(seed)
    aside = 0.02 * rng.normal(size=q.size)
    for k in range(count):
        s = 2.0 * math.pi * k / 200.0
        yield k * DT, q + aside * math.sin(s) ** 3, 15.0 * aside * math.sin(s) ** 2 * math.cos(s)


REQUESTS = {
    30: lambda stack, hand: stack.remove(hand, duration=0.02),
    40: lambda stack, hand: stack.insert(hand, 1, duration=0.02),  # on its way out
    80: lambda stack, hand: stack.remove(hand, duration=0.01),
    110: lambda stack, hand: stack.insert(hand, 1, duration=0.03),  # it has been away
    170: lambda stack, hand: stack.swap("orientation", "position", duration=0.03),
    220: lambda stack, hand: stack.move(hand, 1.5, duration=0.02),
    260: lambda stack, hand: hand.set_target(hand.target + [0.0, 0.03, 0.0]),
}


def request(k, controller, hand):
    if k in REQUESTS:
        REQUESTS[k](controller.stack, hand)
    if k == 300:
        controller.restart()


@pytest.mark.parametrize("seed", range(2))
def test_both_forms_remember_alike_whatever_happens_to_the_stack(seed):
    q, hand, compiled = stretched(osc.Controller)
    _, other, readable = stretched(ReferenceController)
    faded = False
    for k, (t, here, v) in enumerate(course(q, 340, seed)):
        request(k, compiled, hand)
        request(k, readable, other)
        ours = compiled.step(t, here, v)
        assert_same(ours, readable.step(t, here, v))
        assert_same_memory(compiled, readable)
        faded |= any(np.any((h > 0.0) & (h < 1.0)) for h in (x.activation for x in ours.levels))
    assert faded


def test_memory_goes_over_between_compiled_and_readable_ticks(monkeypatch):
    """Twice there are too many tasks for compiled code."""
    q, hand, compiled = stretched(osc.Controller)
    _, other, readable = stretched(ReferenceController)
    fits = Plan.fits
    for k, (t, here, v) in enumerate(course(q, 300, 5)):
        apart = 60 <= k < 120 or 200 <= k < 240
        whole = fits if not apart else lambda members, axes=None: False
        monkeypatch.setattr(Plan, "fits", staticmethod(whole))
        if k in (60, 120, 200, 240):
            for one in (compiled, readable):
                one.stack.insert(osc.JointTask(one.robot.joint_names[0], name=f"{k}"), 3)
        request(k, compiled, hand)
        request(k, readable, other)
        assert_same(compiled.step(t, here, v), readable.step(t, here, v))
        assert_same_memory(compiled, readable)
        assert (compiled._plan is None) == apart


def test_both_forms_remember_alike_where_no_task_was_that_can_be_at_rest():
    q, hand, compiled = stretched(osc.Controller)
    _, other, readable = stretched(ReferenceController)
    pairs = ((compiled, hand), (readable, other))
    for k, (t, here, v) in enumerate(course(q, 60, 6)):
        for controller, task in pairs:
            if k == 10:
                controller.stack.remove("orientation", duration=0.0)
                controller.stack.remove(task, duration=0.0)
            if k == 30:
                controller.stack.insert(task, 1, duration=0.0)
        assert_same(compiled.step(t, here, v), readable.step(t, here, v))
        assert_same_memory(compiled, readable)


def test_many_states_are_each_the_next_tick_and_change_nothing():
    q, _, controller = stretched(osc.Controller)
    _, _, alone = stretched(osc.Controller)
    rng = np.random.default_rng(3)
    for t, here, v in course(q, 120, 1):
        if round(t / DT) % 40 == 39:
            Q, V = here + 0.02 * rng.normal(size=(8, q.size)), rng.normal(size=(8, q.size))
            Q[-1], V[-1] = here, v
            found = controller.torque_batch(Q, V, t)
            np.testing.assert_array_equal(found, controller.torque_batch(Q, V, t))
            np.testing.assert_array_equal(found[-1], controller.step(t, here, v).tau)
        else:
            controller.step(t, here, v)
        np.testing.assert_array_equal(controller.step(t, here, v).tau, alone.step(t, here, v).tau)


def test_a_task_that_stands_at_its_target_is_at_rest_only_after_a_while():
    """At once the buffers are those of motion; after a second they are those at rest."""
    q, hand, controller = stretched(osc.Controller)
    hand.set_target(controller.robot.position(controller.robot.tool).copy())
    still = np.zeros(q.size)
    first = controller.step(0.0, q, still).levels[1].activation.min()
    for k in range(1, 2000):
        last = controller.step(k * DT, q, still)
    assert first < 0.1
    assert last.levels[1].activation.min() > 0.9
    controller.restart()
    assert controller.step(5.0, q, still).levels[1].activation.min() == first


def test_torque_goes_on_where_a_target_jumps_to_and_from_far_away():
    """What is kept cannot jump, and the buffers with it; what a target asks for does."""
    q, hand, controller = stretched(osc.Controller)
    still = np.zeros(q.size)
    for k in range(1000):
        resting = controller.step(k * DT, q, still)
    hand.set_target(hand.target + [0.0, 0.0, 0.8])
    jumped = controller.step(1.0, q, still)
    np.testing.assert_allclose(jumped.levels[1].activation, resting.levels[1].activation, atol=0.02)
    for k in range(1001, 2000):
        moving = controller.step(k * DT, q, still)
    assert moving.levels[1].activation.min() < 0.1


def largest_step(option):
    """Largest torque step of an arm that is led 0.1 m out of reach within 2 s, and back at once."""
    robot = osc.load_robot("ur5")
    robot.update(robot.q_reference, np.zeros(robot.nv))
    start = robot.position(robot.tool).copy()
    goal = start + [0.39, 0.0, 0.0]
    out = osc.MinimumJerk(start, goal, 2.0, start_time=0.1)
    back = osc.MinimumJerk(goal, start, 2.0, start_time=2.1)
    hand = osc.PositionTask(target=osc.Chain((0.0, out), (2.1, back)))
    stack = osc.Stack([osc.OrientationTask(), hand, osc.PostureTask(kp=25.0)])
    seen = []

    class Watch:
        def observe(self, q, v, command):
            seen.append(command.tau)

    controller = osc.Controller(robot, stack, singularity=option)
    osc.simulate(osc.Plant(robot, robot.q_reference), controller, 3.5, [Watch()])
    return np.abs(np.diff(seen, axis=0)).max()


def test_an_arm_that_turns_round_out_of_reach_is_as_smooth_as_with_the_same_buffers_at_rest():
    assert largest_step(NEAR) <= 1.1 * largest_step(osc.Singularity())
