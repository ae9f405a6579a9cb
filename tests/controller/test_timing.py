"""Late, jumping and stale ticks are seen; nothing that is not finite gets out."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.command import Status
from opspace.controller import Controller, ReferenceController
from opspace.errors import InputError, UnknownNameError
from opspace.plan.plan import Plan
from opspace.robots import load_robot
from opspace.stack import Stack
from opspace.tasks import JointTask, PositionTask, PostureTask

BOTH = pytest.mark.parametrize("kind", [Controller, ReferenceController])


def controller_of(kind, **options):
    return kind(load_robot("puma560"), Stack([PositionTask(), PostureTask()]), **options)


def ticks(controller, times, moving=True):
    q, v = controller.robot.q_reference.copy(), np.full(6, 0.1)
    found = []
    for t in times:
        if moving:
            q = q + 1e-4
        found.append(controller.step(t, q, v))
    return found


@BOTH
def test_regular_ticks_are_left_alone(kind):
    times = np.cumsum(np.full(50, 1e-3))
    watched = ticks(controller_of(kind, period=1e-3), times)
    plain = ticks(controller_of(kind), times)
    for a, b in zip(watched, plain, strict=True):
        assert a.status == b.status == Status.OK
        np.testing.assert_array_equal(a.tau, b.tau)


@BOTH
@pytest.mark.parametrize(
    ("second", "expected"),
    [
        (1e-3, Status.OK),
        (1.4e-3, Status.OK),
        (2e-3, Status.LATE),
        (0.011, Status.TIME_JUMP),
        (0.0, Status.TIME_JUMP),
        (-1.0, Status.TIME_JUMP),
    ],
)
def test_what_is_late_and_what_jumps(kind, second, expected):
    assert ticks(controller_of(kind, period=1e-3), [0.0, second])[1].status == expected


@BOTH
def test_a_jump_can_be_held_or_refused(kind):
    held = ticks(controller_of(kind, period=1e-3, on_time_jump="hold"), [1.0, 0.5, 0.501])
    assert held[1].status == Status.TIME_JUMP
    assert held[1].tasks == {}
    robot = load_robot("puma560")
    robot.update(robot.q_reference + 2e-4, np.full(6, 0.1))
    braking = robot.bias - 10.0 * robot.M.diagonal() * robot.v
    np.testing.assert_allclose(held[1].tau, braking, atol=1e-12)
    assert held[2].status == Status.OK
    assert held[2].tasks
    with pytest.raises(InputError, match=r"from 1 s to 0\.5 s"):
        ticks(controller_of(kind, period=1e-3, on_time_jump="raise"), [1.0, 0.5])


@BOTH
def test_a_state_that_does_not_change_is_stale_unless_the_robot_rests(kind):
    controller = controller_of(kind, period=1e-3)
    assert ticks(controller, [0.0, 1e-3], moving=False)[1].status == Status.STALE
    rest = np.zeros(6)
    controller = controller_of(kind, period=1e-3)
    found = [controller.step(t, controller.robot.q_reference, rest) for t in (0.0, 1e-3)]
    assert found[1].status == Status.OK


def test_bad_options_are_refused():
    with pytest.raises(InputError, match="period must be finite"):
        controller_of(Controller, period=0.0)
    with pytest.raises(UnknownNameError, match=r"on_time_jump 'hodl'.*hold"):
        controller_of(Controller, period=1e-3, on_time_jump="hodl")
    with pytest.raises(InputError, match="needs the period"):
        controller_of(Controller, on_time_jump="hold")


NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


@BOTH
@settings(max_examples=80)
@given(
    st.lists(NUMBERS, min_size=6, max_size=6), st.lists(NUMBERS, min_size=6, max_size=6), NUMBERS
)
def test_whatever_comes_in_what_goes_out_is_finite(kind, q, v, t):
    controller = controller_of(kind, torque_limits="priority")
    given_ = {"q[": q, "velocity of joint": v, "time": [t]}
    wrong = "|".join(re.escape(name) for name, x in given_.items() if not np.isfinite(x).all())
    with np.errstate(all="ignore"):
        if wrong:
            with pytest.raises(InputError, match=wrong):
                controller.step(t, q, v)
            return
        command = controller.step(t, q, v)
    assert np.isfinite(command.tau).all()
    assert np.all(np.abs(command.tau) <= controller.robot.torque_limit * (1 + 1e-12))


def test_more_tasks_than_are_compiled_are_watched_as_well():
    tasks = [JointTask("joint1", name=f"joint {k}") for k in range(40)]
    controller = Controller(load_robot("puma560"), Stack([tasks]), period=1e-3)
    assert not Plan.fits(controller.stack.members)
    first, second, late = ticks(controller, [0.0, 0.001, 0.004])
    assert Status.TIME_JUMP not in first.status | second.status | late.status
    assert Status.LATE in late.status
    with pytest.raises(InputError, match="nan"):
        controller.step(0.005, np.full(6, np.nan), np.zeros(6))
