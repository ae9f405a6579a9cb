"""Profiles, buffers and ramps: derivatives, ends, and changes of mind without a step."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.errors import InputError, UnknownNameError
from opspace.law import PROFILES, Buffer, Profile, Ramp
from tests.budget import examples

MANY = examples(60)
UNIT = st.floats(0.005, 0.995)
SMOOTH = [name for name in PROFILES if name != "step"]


@pytest.mark.parametrize("name", PROFILES)
def test_profiles_rise_from_zero_to_one(name):
    profile = Profile(name)
    values = [profile(s).value for s in np.linspace(-0.5, 1.5, 401)]
    assert values[0] == 0.0
    assert values[-1] == 1.0
    assert np.all(np.diff(values) >= 0)
    if name != "step":
        assert profile(0.5).value == pytest.approx(0.5, abs=1e-12)
    for outside in (-1.0, 0.0, 1.0, 2.0, -5e-324):
        assert profile(outside)[1:] == (0.0, 0.0)


@pytest.mark.parametrize("name", SMOOTH)
@MANY
@given(s=UNIT)
def test_slope_and_curvature_are_the_derivatives(name, s):
    profile, d = Profile(name), 1e-6
    ahead, here, behind = profile(s + d), profile(s), profile(s - d)
    scale = 1 + abs(here.slope) + abs(here.curvature)
    assert (ahead.value - behind.value) / (2 * d) == pytest.approx(here.slope, abs=1e-5 * scale)
    assert (ahead.slope - behind.slope) / (2 * d) == pytest.approx(here.curvature, abs=1e-3 * scale)


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("s", [5e-324, 1e-300, 1e-9, 1e-3, 0.0041, 1 - 1e-3, 1 - 1e-16])
def test_profiles_are_finite_and_in_range_next_to_their_ends(name, s):
    h = Profile(name)(s)
    assert np.all(np.isfinite(h))
    assert 0.0 <= h.value <= 1.0


@pytest.mark.parametrize(
    ("name", "order"), [("linear", 0), ("cubic", 1), ("half-sine", 1), ("quintic", 2), ("tanh", 2)]
)
def test_smoothness_at_the_ends(name, order):
    inside = [Profile(name)(1e-9), Profile(name)(1 - 1e-9)]
    outside = [Profile(name)(0.0), Profile(name)(1.0)]
    for i, o in zip(inside, outside, strict=True):
        steps = np.abs(np.subtract(i, o))
        assert np.all(steps[: order + 1] < 1e-6)
        if order < 2:
            assert steps[order + 1] > 0.5  # and no smoother than the table says


@MANY
@given(UNIT, st.floats(-5, 5), st.floats(0.01, 10), st.sampled_from(SMOOTH), st.booleans())
def test_a_buffer_is_its_profile_between_two_edges(s, off, width, name, falling):
    on = off - width if falling else off + width
    buffer, profile = Buffer(off, on, name), Profile(name)(s)
    got = buffer(off + s * (on - off))
    sign = -1 if falling else 1
    assert got.value == pytest.approx(profile.value, abs=1e-6)
    assert got.slope == pytest.approx(sign * profile.slope / width, abs=1e-3 / width)
    assert buffer(off).value == 0.0
    assert buffer(on).value == 1.0


@pytest.mark.parametrize(("off", "on"), [(1.0, 1.0), (np.nan, 1.0), (0.0, np.inf)])
def test_a_buffer_needs_two_finite_edges(off, on):
    with pytest.raises(InputError, match="two different finite edges"):
        Buffer(off, on)


def test_unknown_profiles_are_named_with_the_choices():
    with pytest.raises(UnknownNameError, match=r"'quintc'; did you mean 'quintic'.*half-sine"):
        Profile("quintc")


@MANY
@given(st.floats(-100, 100), st.floats(0.01, 10), st.sampled_from(SMOOTH), UNIT)
def test_an_undisturbed_ramp_is_the_profile_of_time(start, duration, name, s):
    ramp = Ramp.resting(0.0, name).towards(1.0, duration, start)
    assert ramp(start).value == 0.0
    assert ramp(start + 1.001 * duration) == (1.0, 0.0, 0.0)
    assert ramp(start + s * duration).value == pytest.approx(Profile(name)(s).value, abs=1e-6)
    down = ramp.towards(0.0, duration, start + 2 * duration)
    assert down(start + (2 + s) * duration).value == pytest.approx(
        1 - Profile(name)(s).value, abs=1e-6
    )


CHANGES = st.lists(
    st.tuples(st.floats(0.0, 1.5), st.sampled_from([0.0, 1.0]), st.floats(0.02, 5.0)),
    min_size=1,
    max_size=6,
)


@MANY
@given(CHANGES, st.sampled_from(["quintic", "tanh", "cubic", "half-sine"]))
def test_a_ramp_changes_its_mind_without_a_step(changes, name):
    """Requests at any moment, also in the middle of the answer to the one before."""
    t, ramp = 0.0, Ramp.resting(0.0, name).towards(1.0, 1.0, 0.0)
    for fraction, target, duration in changes:
        t += fraction * ramp.duration
        new = ramp.towards(target, duration, t)
        before, after = ramp(t), new(t)
        scale = 1 + abs(before.slope) + abs(after.slope)
        assert after.value == pytest.approx(before.value, abs=1e-9)
        assert after.slope == pytest.approx(before.slope, abs=1e-6 * scale)
        if 0.0 < before.value < 1.0 and name in ("quintic", "tanh"):
            curve = 1 + abs(before.curvature)
            assert after.curvature == pytest.approx(before.curvature, abs=1e-5 * curve)
        times = np.linspace(t, t + duration, 80)
        values = np.array([new(x).value for x in times])
        assert np.all((values >= 0.0) & (values <= 1.0))
        assert new(t + duration).value == pytest.approx(target, abs=1e-9)
        assert new(t + duration + 1e-9).value == target
        d = 1e-6 * duration
        for x in times[1:-1:10]:
            numeric = (new(x + d).value - new(x - d).value) / (2 * d)
            curve = abs(new(x).curvature) + abs(new(x + d).curvature - new(x - d).curvature)
            assert numeric == pytest.approx(new(x).slope, abs=1e-3 / duration + curve * d)
        ramp = new


@MANY
@given(st.floats(0.05, 0.95), st.floats(0.05, 10), st.floats(0.05, 10))
def test_a_reversed_ramp_is_about_as_fast_as_it_was_asked_to_be(fraction, first, second):
    """Fading out over ``second`` seconds does not sit at 1 and then fall in an instant."""
    up = Ramp.resting(0.0).towards(1.0, first, 0.0)
    t = fraction * first
    down = up.towards(0.0, second, t)
    slopes = [down(x).slope for x in np.linspace(t, t + second, 150)]
    assert -min(slopes) <= 5.0 / second + 1e-9


ANY_LENGTH = st.one_of(
    st.floats(0.0, allow_infinity=False, allow_nan=False),
    st.sampled_from([5e-324, 1e-9, 1e154, 1e155, 1e300, 1.7e308]),
)


@MANY
@given(
    st.lists(st.tuples(UNIT, st.sampled_from([0.0, 1.0]), ANY_LENGTH), min_size=2, max_size=6),
    st.sampled_from(PROFILES),
)
def test_no_duration_is_too_long_or_too_short(changes, name):
    """Whatever is finite is a duration, also for a request that meets a ramp on its way."""
    t, ramp = 0.0, Ramp.resting(0.0, name).towards(1.0, 1e300, 0.0)
    for fraction, target, duration in changes:
        t = min(t + fraction * min(ramp.duration, 1e300), 1e300)
        new = ramp.towards(target, duration, t)
        if new.duration > 0.0 and name != "step":
            assert new(t).value == pytest.approx(ramp(t).value, abs=1e-9)
        assert 0.0 <= new(t + 0.5 * duration).value <= 1.0
        assert np.all(np.isfinite(new.numbers))
        assert np.all(np.isfinite(new(t)))
        ramp = new


@MANY
@given(
    st.floats(0.0, 1e6),
    st.floats(1e-3, 1e3),
    st.floats(0.0, 1.0),
    st.floats(1e-3, 10.0),
    st.sampled_from([0.0, 1.0]),
    st.sampled_from(PROFILES),
)
def test_a_ramp_that_has_finished_is_at_its_target_exactly(
    start, first, fraction, second, target, name
):
    """The sum of two times is rounded: what says that it is over and what it is must round alike."""
    up = Ramp.resting(0.0, name).towards(1.0, first, start)
    for ramp in (up, up.towards(target, second, start + fraction * first)):
        end = ramp.start_time + ramp.duration
        for t in (math.nextafter(end, -math.inf), end, math.nextafter(end, math.inf)):
            assert 0.0 <= ramp(t).value <= 1.0
            if ramp.finished(t):
                assert ramp(t) == (ramp.target, 0.0, 0.0)
        assert ramp.finished(end)


def test_zero_duration_is_a_hard_switch():
    ramp = Ramp.resting(0.0).towards(1.0, 0.0, 2.0)
    assert ramp(2.0) == (1.0, 0.0, 0.0)
    assert ramp.finished(2.0)


@pytest.mark.parametrize(
    ("target", "duration", "t", "message"),
    [
        (0.5, 1.0, 0.0, "0 or 1"),
        (1.0, -1.0, 0.0, ">= 0 s"),
        (1.0, np.nan, 0.0, ">= 0 s"),
        (1.0, 1.0, np.inf, "time of a ramp"),
    ],
)
def test_bad_requests_are_refused(target, duration, t, message):
    with pytest.raises(InputError, match=message):
        Ramp.resting(0.0).towards(target, duration, t)
