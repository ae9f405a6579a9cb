"""The fastest motion of one coordinate to rest, against Ruckig's and by what it must keep."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import opspace as osc
from opspace.law.swift_motion import changed, swift_at, swift_motion, swift_time

part = st.floats(-1.0, 1.0)
sizes = st.tuples(st.floats(0.05, 5.0), st.floats(0.05, 20.0), st.floats(0.5, 200.0))
ways = st.floats(-3.0, 3.0)


def planned(d, v, a, limits):
    speed, most, jerk = limits
    plan = swift_motion(d, v, a, speed, most, jerk)
    return plan, swift_time(*plan, v, a, most, jerk)


def along(plan, end, v, a, limits, count=60):
    _, most, jerk = limits
    times = np.linspace(0.0, end, count)
    return times, np.array([swift_at(t, *plan, v, a, most, jerk) for t in times])


@given(ways, part, part, sizes)
def test_it_takes_as_long_as_the_fastest_motion_there_is(d, v, a, limits):
    speed, most, jerk = limits
    v, a = v * speed, a * most
    assume(abs(v + 0.5 * a * abs(a) / jerk) < 0.999 * speed)  # else no motion keeps the limits
    _, end = planned(d, v, a, limits)
    try:
        other = osc.JerkLimited(
            [0.0],
            [d],
            max_velocity=speed,
            max_acceleration=most,
            max_jerk=jerk,
            start_time=0.0,
            start_velocity=[v],
            start_acceleration=[a],
        )
    except osc.InputError:
        return
    assert end == pytest.approx(other.duration, rel=1e-6, abs=1e-6)


@given(ways, part, part, sizes, st.sampled_from([0.0, 0.9, 2.5]))
def test_it_arrives_at_rest_without_a_step_and_within_its_limits(d, v, a, limits, above):
    """Also where it begins above its limits; then it goes back to them."""
    speed, most, jerk = limits
    v, a = above * v * speed, above * a * most
    plan, end = planned(d, v, a, limits)
    times, found = along(plan, end, v, a, limits)
    x, u, b = found.T
    size = max(abs(d), abs(v) * end, abs(a) * end * end, speed * end)
    np.testing.assert_allclose(found[0], [0.0, v, a], atol=1e-12 * max(1.0, abs(v), abs(a)))
    assert x[-1] == pytest.approx(d, abs=1e-9 * max(size, 1.0))
    assert abs(u[-1]) < 1e-9 * max(speed, abs(v))
    assert abs(b[-1]) < 1e-7 * max(most, abs(a))
    eased = v + 0.5 * a * abs(a) / jerk
    assert np.abs(u).max() <= max(speed, abs(v), abs(eased)) * (1.0 + 1e-9)
    assert np.abs(b).max() <= max(most, abs(a)) * (1.0 + 1e-9)
    step = times[1]
    assert np.abs(np.diff(b)).max() <= jerk * step * (1.0 + 1e-6) + 1e-9 * most
    assert np.abs(np.diff(u)).max() <= max(most, abs(a)) * step * (1.0 + 1e-6) + 1e-9


@given(ways, sizes)
def test_from_rest_it_is_the_same_forwards_and_backwards(d, limits):
    plan, end = planned(d, 0.0, 0.0, limits)
    _, found = along(plan, end, 0.0, 0.0, limits, 21)
    np.testing.assert_allclose(found[:, 0] + found[::-1, 0], d, atol=1e-9 * abs(d) + 1e-15)
    np.testing.assert_allclose(found[:, 1], found[::-1, 1], atol=1e-9 * limits[0])


def test_nowhere_takes_no_time():
    plan, end = planned(0.0, 0.0, 0.0, (1.0, 1.0, 10.0))
    assert end == 0.0
    assert swift_at(0.0, *plan, 0.0, 0.0, 1.0, 10.0) == (0.0, 0.0, 0.0)


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), sizes)
def test_a_speed_and_an_acceleration_that_stop_by_themselves_need_only_that(v, a, limits):
    """The goal is where the fastest stop ends."""
    _, most, jerk = limits
    a = min(max(a, -most), most)
    stop, time = changed(v, a, 0.0, most, jerk)
    assume(math.isfinite(stop) and abs(v + 0.5 * a * abs(a) / jerk) < limits[0])
    _, end = planned(stop, v, a, limits)
    assert end == pytest.approx(time, rel=1e-5, abs=1e-6)
