"""Contacts in a stack: one progress, motion before force coming in, force before motion going out."""

import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import opspace as osc
from opspace.errors import InputError, UnknownNameError
from opspace.stack.changes import Timing
from opspace.stack.contact_course import MOTION_PART, ContactCourse

DT = 0.01


def sole(name="foot"):
    return osc.SoleContact(name, (0.1, 0.05))


def stack_of(*contacts):
    return osc.Stack([osc.PostureTask()], contacts=contacts)


def run(stack, start, seconds):
    """The progress of the only contact at every tick, 0 where there is none."""
    found = []
    for i in range(round(seconds / DT)):
        members = stack.begin_contacts(start + i * DT)
        found.append(members[0].progress if members else 0.0)
    return found


requests = st.lists(
    st.tuples(st.booleans(), st.sampled_from([0.05, 0.2, 1.0]), st.integers(1, 40), st.booleans()),
    min_size=1,
    max_size=8,
)


@given(requests, st.sampled_from(["linear", "quintic", "cubic"]))
@settings(max_examples=60, deadline=None)
def test_whatever_is_asked_motion_holds_as_long_as_force_is_there(asked, kind):
    foot = sole()
    stack = stack_of(foot)
    stack.begin_contacts(0.0)
    t, before = 0.0, 1.0
    for goes_in, duration, ticks, waits in asked:
        if goes_in:
            stack.insert(foot, duration, profile=kind)
        elif foot.name in stack.contacts:
            stack.remove(foot, duration, profile=kind, wait=waits)
        for _ in range(ticks):
            t += DT
            members = stack.begin_contacts(t)
            motion, force = members[0].activations(1.0) if members else (0.0, 0.0)
            progress = members[0].progress if members else 0.0
            assert 0.0 <= force <= 1.0
            assert motion == 1.0 or force == 0.0
            assert abs(progress - before) <= DT / 0.05 + 1e-12
            before = progress


def test_it_goes_in_and_out_in_its_time_and_turns_around_where_it_is():
    foot = sole()
    stack = stack_of()
    stack.insert(foot, 1.0)
    there = run(stack, 0.0, 0.5)
    assert there[0] == 0.0
    assert np.allclose(np.diff(there), DT)
    stack.remove(foot, 0.5)
    back = run(stack, 0.5, 0.3)
    assert abs(back[0] - there[-1]) <= 2 * DT / 0.5
    assert back[-1] == 0.0
    assert not stack.contacts
    assert stack.settled


def test_a_contact_that_waits_stays_and_comes_back_no_further_than_it_was():
    foot = sole()
    stack = stack_of(foot)
    run(stack, 0.0, 0.1)
    stack.remove(foot, 1.0)
    before = run(stack, 0.1, 0.3)[-1]
    stack.hinder(1.0)
    assert np.ptp(run(stack, 0.4, 0.2)) < 1e-12 + DT  # one tick late
    assert stack._contacts.present[0].waiting
    assert not stack.settled
    stack.hinder(1e9)
    assert max(run(stack, 0.6, 2.0)) == 1.0
    stack.hinder(0.0)
    assert run(stack, 2.6, 1.2)[-1] == 0.0
    assert before < 1.0


@given(
    st.sampled_from([0.001, 0.005, 0.01]),
    st.sampled_from([0.05, 0.2, 1.0]),
    st.floats(5.0, 500.0),
    st.floats(0.2, 0.9),
)
@settings(max_examples=60, deadline=None)
def test_one_that_waits_comes_to_rest_whatever_the_tick(dt, duration, steepness, place):
    """What it gives up grows as it goes; the tick after tells how much that was."""
    foot = sole()
    stack = stack_of(foot)
    stack.begin_contacts(0.0)
    stack.remove(foot, duration)
    found = []
    for i in range(1, round(3.0 * duration / dt) + 600):
        (member,) = stack.begin_contacts(i * dt)
        found.append(member.progress)
        stack.hinder(max(0.0, 1.0 + steepness * (place - member.progress)))
    assert np.max(np.abs(np.diff(found[-50:]))) <= 1e-4
    assert abs(found[-1] - place) <= 0.01
    assert member.waiting
    stack.hinder(0.0)
    for i in range(round(3.0 * duration / dt) + 600, round(6.0 * duration / dt) + 1200):
        stack.begin_contacts(i * dt)
        stack.hinder(0.0)
    assert not stack.contacts


def test_forced_or_coming_in_it_waits_for_nobody():
    foot = sole()
    stack = stack_of(foot)
    stack.hinder(5.0)
    run(stack, 0.0, 0.1)
    stack.remove(foot, 0.2, wait=False)
    assert run(stack, 0.1, 0.3)[-1] == 0.0
    stack.insert(foot, 0.2)
    assert run(stack, 0.4, 0.3)[-1] == 1.0


def test_a_hard_switch_waits_for_nobody():
    foot = sole()
    stack = stack_of(foot)
    run(stack, 0.0, 0.05)
    stack.hinder(5.0)
    stack.remove(foot, 0.0)
    assert run(stack, 0.05, 0.1) == [0.0] * 10


def test_a_request_waits_for_its_time_and_can_be_cancelled():
    foot = sole()
    stack = stack_of()
    stack.insert(foot, 0.1, start_time=1.0)
    assert run(stack, 0.0, 0.9)[-1] == 0.0
    assert "foot" in stack.contacts
    stack.cancel_scheduled()
    assert not stack.contacts
    assert run(stack, 0.9, 0.5)[-1] == 0.0


def test_after_a_pause_it_goes_on_from_where_it_was():
    foot = sole()
    stack = stack_of()
    stack.insert(foot, 1.0)
    before = run(stack, 0.0, 0.4)[-1]
    stack.resume()
    assert run(stack, 100.0, 0.1)[0] == before


def test_names_levels_and_what_is_no_contact_are_refused():
    foot = sole()
    stack = stack_of(foot)
    with pytest.raises(InputError, match="no level"):
        stack.insert(sole("hand"), 1.0, 0.5)
    with pytest.raises(InputError, match="'foot' is the name of another member"):
        stack.insert(sole())
    with pytest.raises(InputError, match="'posture' is the name of another member"):
        stack.insert(sole("posture"))
    with pytest.raises(InputError, match="'foot' is the name of a contact"):
        stack.insert(osc.PositionTask(name="foot"), 0)
    with pytest.raises(InputError, match="a task needs a level"):
        stack.insert(osc.PositionTask(name="hand"))
    with pytest.raises(InputError, match="only contacts wait"):
        stack.remove("posture", wait=True)
    with pytest.raises(InputError, match="SoleContact, EdgeContact or PointContact"):
        osc.Stack([], contacts=[osc.PostureTask()])
    with pytest.raises(UnknownNameError, match="hand"):
        stack.remove(sole("hand"))
    with pytest.raises(InputError, match="at most 16 contacts"):
        stack_of(*(sole(f"foot{i}") for i in range(17)))
    for bad in ({"friction": 0.0}, {"max_force": -1.0}, {"offset": (0.0, np.nan, 0.0)}):
        with pytest.raises(InputError, match="contact 'foot'"):
            osc.SoleContact("foot", (0.1, 0.05), **bad)
    with pytest.raises(InputError, match="normal must not be zero"):
        osc.PointContact("foot", normal=(0.0, 0.0, 0.0))


def test_requests_come_from_any_thread():
    feet = [sole(f"foot{i}") for i in range(6)]
    stack = stack_of()
    threads = [threading.Thread(target=stack.insert, args=(one, 0.05)) for one in feet]
    for thread in threads:
        thread.start()
    for i in range(50):
        stack.begin_contacts(i * DT)
    for thread in threads:
        thread.join()
    for i in range(50, 70):
        members = stack.begin_contacts(i * DT)
    assert sorted(m.contact.name for m in members) == sorted(one.name for one in feet)
    assert all(m.progress == 1.0 for m in members)
    assert MOTION_PART < 1.0


def test_it_says_what_it_touches():
    assert "contacts: foot" in repr(stack_of(sole()))
    assert repr(sole()) == "SoleContact('foot', friction=0.5)"


@pytest.mark.parametrize("pause", [-7.0, 7.0])
def test_what_waits_for_its_time_waits_on_and_what_is_asked_in_a_pause_is_in_the_new_time(pause):
    left, right, course = osc.PointContact("left"), osc.PointContact("right"), ContactCourse()
    course.start_with(left)
    course.begin_tick(5.0)
    course.remove(left, Timing(0.0, start_time=5.5), wait=False)
    course.resume()
    course.insert(right, Timing(0.0, start_time=5.25 + pause))
    present = [
        [member.contact.name for member in course.begin_tick(5.0 + 0.125 * k + pause)]
        for k in range(6)
    ]
    assert present == [["left"]] * 2 + [["left", "right"]] * 2 + [["right"]] * 2
