"""References: derivatives, ends, and what each promises of its way."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from opspace.errors import InputError
from opspace.tasks import (
    Chain,
    Circle,
    Constant,
    JerkLimited,
    MinimumJerk,
    OrientationJerkLimited,
    OrientationMinimumJerk,
    PoseReference,
    ViaPoints,
)
from opspace.tasks.rotation import exp_rotation, log_rotation

START, GOAL = np.array([0.3, -0.2, 0.1]), np.array([-0.1, 0.4, 0.6])
MIDDLE = np.array([[0.1, 0.5, -0.2], [0.2, 0.1, 0.3]])

durations = st.floats(0.05, 20.0)
starts = st.floats(-5.0, 5.0)
phases = st.floats(-0.2, 1.3)


def jerk_limited(duration, start):
    """Scale the limits so that the motion takes about the given time."""
    scale = 1.0 / duration
    return JerkLimited(
        START,
        GOAL,
        max_velocity=2.0 * scale,
        max_acceleration=10.0 * scale**2,
        max_jerk=200.0 * scale**3,
        start_time=start,
    )


def out_and_back(duration, start):
    third = duration / 3.0
    back = start + 2.0 * third
    return Chain(
        (start, MinimumJerk(START, GOAL, third, start_time=start)),
        (back, MinimumJerk(GOAL, START, third, start_time=back)),
    )


# name: (reference of a duration and a start time, first value, last value or None)
MOTIONS = {
    "minimum jerk": (lambda d, t0: MinimumJerk(START, GOAL, d, t0), START, GOAL),
    "via points": (
        lambda d, t0: ViaPoints(
            t0 + d * np.array([0.0, 0.3, 0.6, 1.0]), np.vstack((START, MIDDLE, GOAL))
        ),
        START,
        GOAL,
    ),
    "jerk limited": (jerk_limited, START, GOAL),
    "out and back": (out_and_back, START, START),
    "circle": (
        lambda d, t0: Circle(START, 0.2, d, normal=GOAL, start_time=t0, ramp=0.7 * d),
        Circle(START, 0.2, 1.0, normal=GOAL).start,
        None,
    ),
    "constant": (lambda *_: Constant(START), START, START),
}
motions = pytest.mark.parametrize(
    ("make", "first", "last"), list(MOTIONS.values()), ids=list(MOTIONS)
)


@motions
@given(durations, starts, phases)
def test_velocity_and_acceleration_are_derivatives(make, first, last, duration, start, phase):
    reference, t, h = make(duration, start), start + phase * duration, 1e-5 * duration
    before, here, after = reference(t - h), reference(t), reference(t + h)
    tolerance = 2e-3 / duration
    np.testing.assert_allclose((after.x - before.x) / (2.0 * h), here.v, rtol=0, atol=tolerance)
    # A jerk-limited motion has corners of the acceleration: its jerk is up to 200/duration³.
    np.testing.assert_allclose(
        (after.v - before.v) / (2.0 * h), here.a, rtol=0, atol=1e1 * tolerance / duration
    )


@motions
@given(durations, starts)
def test_motions_begin_and_end_at_rest_where_they_should(make, first, last, duration, start):
    reference = make(duration, start)
    for t in (start, start - 1.0, -math.inf):
        begin = reference(t)
        np.testing.assert_array_equal(begin.x, first)
        np.testing.assert_array_equal((begin.v, begin.a), 0.0)
    if last is not None:
        for t in (start + 1.1 * duration, start + 1e3 * duration, math.inf):
            end = reference(t)
            np.testing.assert_array_equal(end.x, last)
            np.testing.assert_array_equal((end.v, end.a), 0.0)


@given(durations, starts, st.floats(0.0, 1.0))
def test_minimum_jerk_is_straight_monotone_and_symmetric(duration, start, phase):
    reference = MinimumJerk(START, GOAL, duration, start)
    way = GOAL - START
    early, late = (
        reference(start + phase * duration),
        reference(start + (1.0 - phase) * duration),
    )
    np.testing.assert_allclose(early.x + late.x, START + GOAL, atol=1e-9)
    progress = (early.x - START) @ way / (way @ way)
    np.testing.assert_allclose(early.x, START + progress * way, atol=1e-12)
    assert -1e-12 <= progress <= 1.0 + 1e-12
    assert early.v @ way >= 0.0


@given(durations, starts, phases)
def test_two_via_points_are_a_minimum_jerk_motion(duration, start, phase):
    spline = ViaPoints([start, start + duration], [START, GOAL])
    plain = MinimumJerk(START, GOAL, duration, start)
    t = start + phase * duration
    for one, two, scale in zip(spline(t), plain(t), (1.0, duration, duration**2), strict=True):
        np.testing.assert_allclose(scale * one, scale * two, rtol=0, atol=1e-8)


def test_via_points_are_passed_at_their_times(rng):
    times, points = np.cumsum(rng.uniform(0.2, 1.0, 6)), rng.normal(size=(6, 4))
    reference = ViaPoints(times, points)
    for time, point in zip(times, points, strict=True):
        np.testing.assert_allclose(reference(time).x, point, atol=1e-12)
    for end in (times[0] + 1e-7, times[-1] - 1e-7):
        np.testing.assert_allclose(reference(end).a, 0.0, atol=1e-2)


@given(
    st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=4),
    st.floats(0.1, 3.0),
    st.floats(0.1, 10.0),
    st.floats(1.0, 100.0),
)
def test_jerk_limited_motion_stays_within_its_limits(goal, velocity, acceleration, jerk):
    reference = JerkLimited(
        np.zeros(len(goal)),
        goal,
        max_velocity=velocity,
        max_acceleration=acceleration,
        max_jerk=jerk,
    )
    samples = [reference(t) for t in np.linspace(0.0, reference.duration, 60)]
    assert np.abs([s.v for s in samples]).max() <= velocity * (1.0 + 1e-9)
    assert np.abs([s.a for s in samples]).max() <= acceleration * (1.0 + 1e-9)
    steps = np.abs(np.diff([s.a for s in samples], axis=0)).max()
    assert steps <= jerk * reference.duration / 59 * (1.0 + 1e-6) + 1e-9


@given(durations, st.floats(0.1, 2.0), st.floats(0.0, 5.0))
def test_circle_keeps_its_radius_plane_and_final_speed(period, ramp, turns):
    normal, radius = np.array([0.36, 0.48, 0.8]), 0.25
    reference = Circle(START, radius, period, normal=normal, ramp=ramp * period)
    sample = reference(turns * period)
    spoke = sample.x - START
    np.testing.assert_allclose(np.linalg.norm(spoke), radius, rtol=1e-12)
    np.testing.assert_allclose(spoke @ normal, 0.0, atol=1e-12)
    assert np.cross(spoke, sample.v) @ normal >= -1e-12
    if turns > ramp:
        np.testing.assert_allclose(
            np.linalg.norm(sample.v), 2.0 * math.pi * radius / period, rtol=1e-9
        )
        again = reference((turns + 1.0) * period)
        np.testing.assert_allclose(again.x, sample.x, atol=1e-9)


vectors = st.tuples(*[st.floats(-1.7, 1.7)] * 3).map(np.array)


@given(vectors, vectors, durations, st.floats(0.0, 1.0))
def test_orientation_rates_are_the_derivatives(first, second, duration, phase):
    R_start, R_goal = exp_rotation(first), exp_rotation(second)
    reference = OrientationMinimumJerk(R_start, R_goal, duration, 0.5)
    np.testing.assert_allclose(reference(0.5).x, R_start, atol=1e-14)
    np.testing.assert_allclose(reference(0.5 + duration).x, R_goal, atol=1e-14)
    t, h = 0.5 + phase * duration, 1e-5 * duration
    before, here, after = reference(t - h), reference(t), reference(t + h)
    np.testing.assert_allclose(here.x @ here.x.T, np.eye(3), atol=1e-13)
    omega = log_rotation(after.x @ before.x.T) / (2.0 * h)
    np.testing.assert_allclose(omega, here.v, rtol=0, atol=1e-6 / duration)
    np.testing.assert_allclose(
        (after.v - before.v) / (2.0 * h), here.a, rtol=0, atol=2e-2 / duration**2
    )


LIMITS = {"max_velocity": 1.0, "max_acceleration": 4.0, "max_jerk": 40.0}


@given(vectors, vectors, st.floats(0.0, 1.2))
def test_a_jerk_limited_motion_gets_another_goal_on_its_way_without_a_step(goal, other, t):
    first = JerkLimited(np.zeros(3), goal, **LIMITS)
    x, v, a = first(t)
    second = JerkLimited(x, other, **LIMITS, start_time=t, start_velocity=v, start_acceleration=a)
    for one, two in zip(second(t), (x, v, a), strict=True):
        np.testing.assert_array_equal(one, two)
    np.testing.assert_allclose(second(t + 1e-7).x, x, atol=1e-6)
    np.testing.assert_allclose(second(t + 1e-7).v, v, atol=1e-6)
    np.testing.assert_allclose(second(t + 1e-7).a, a, atol=1e-5)
    np.testing.assert_array_equal(second(t + second.duration + 1e-9).x, other)


@given(vectors, vectors, vectors, st.floats(1e-9, 1e-6))
@example(np.zeros(3), np.array([0.0, 1.25, 0.0625]), np.zeros(3), 1e-7)
def test_a_jerk_limited_motion_comes_to_its_goal_without_a_step(start, velocity, goal, before):
    motion = JerkLimited(start, goal, **LIMITS, start_time=0.5, start_velocity=velocity)
    x, v, a = motion(0.5 + motion.duration * (1.0 - before))
    np.testing.assert_allclose(x, goal, rtol=0, atol=1e-12)
    np.testing.assert_allclose(v, 0.0, atol=1e-9)
    np.testing.assert_allclose(a, 0.0, atol=1e-3)


@given(vectors, vectors, vectors, vectors, st.floats(0.0, 1.0))
@example(np.zeros(3), np.zeros(3), np.array([0.0, 1.25, 0.0625]), np.zeros(3), 1.0)
def test_a_jerk_limited_turn_begins_as_told_and_has_true_rates(first, goal, omega, alpha, phase):
    R_start, R_goal = exp_rotation(first), exp_rotation(goal)
    turn = OrientationJerkLimited(
        R_start,
        R_goal,
        **LIMITS,
        start_time=0.5,
        start_velocity=omega,
        start_acceleration=alpha,
    )
    begin = turn(0.5)
    for found, told in zip(begin, (R_start, omega, alpha), strict=True):
        np.testing.assert_allclose(found, told, atol=1e-12)
    end = turn(0.5 + turn.duration + 1e-9)
    np.testing.assert_array_equal(end.x, turn.goal)
    np.testing.assert_array_equal((end.v, end.a), 0.0)
    t, h = 0.5 + phase * turn.duration, 1e-5
    before, here, after = turn(max(t - h, 0.5)), turn(t), turn(t + h)
    span = t + h - max(t - h, 0.5)
    turned = log_rotation(after.x @ before.x.T) / span
    # Half a step away where the difference is one-sided; the jerk has corners.
    np.testing.assert_allclose(turned, here.v, rtol=0, atol=2e-4)
    np.testing.assert_allclose((after.v - before.v) / span, here.a, rtol=0, atol=5e-3)


@given(vectors, vectors)
def test_orientation_goes_the_short_way_round(first, second):
    R_start, R_goal = exp_rotation(first), exp_rotation(second)
    reference = OrientationMinimumJerk(R_start, R_goal, 1.0)
    whole = np.linalg.norm(log_rotation(R_goal @ R_start.T))
    half = np.linalg.norm(log_rotation(reference(0.5).x @ R_start.T))
    np.testing.assert_allclose(half, 0.5 * whole, atol=1e-9)


def test_a_pose_reference_joins_its_parts():
    position = MinimumJerk(START, GOAL, 1.0)
    orientation = OrientationMinimumJerk(np.eye(3), exp_rotation(GOAL), 1.0)
    x, v, a = PoseReference(position, orientation)(0.4)
    np.testing.assert_array_equal(x[:3, 3], position(0.4).x)
    np.testing.assert_allclose(x[:3, :3], orientation(0.4).x, atol=1e-14)
    np.testing.assert_array_equal(v, np.concatenate((position(0.4).v, orientation(0.4).v)))
    np.testing.assert_array_equal(a, np.concatenate((position(0.4).a, orientation(0.4).a)))


@pytest.mark.parametrize(
    ("build", "reason"),
    [
        (lambda: MinimumJerk(START, GOAL[:2], 1.0), "goal"),
        (lambda: MinimumJerk(START, GOAL, 0.0), "duration"),
        (lambda: MinimumJerk(START, GOAL, math.nan), "duration"),
        (lambda: MinimumJerk(START, GOAL * math.inf, 1.0), "goal"),
        (lambda: MinimumJerk(START, GOAL, 1.0, "now"), "start_time"),
        (lambda: OrientationMinimumJerk(np.eye(3), START, 1.0), "goal"),
        (lambda: ViaPoints([0.0], [START]), "times"),
        (lambda: ViaPoints([0.0, 0.0], [START, GOAL]), "times"),
        (lambda: ViaPoints([0.0, 1.0, 2.0], [START, GOAL]), "points"),
        (lambda: Circle(START, -1.0, 1.0), "radius"),
        (lambda: Circle(START, 1.0, 0.0), "period"),
        (lambda: Circle(START, 1.0, 1.0, normal=np.zeros(3)), "normal"),
        (lambda: jerk_limited(-1.0, 0.0), "max_velocity"),
        (Chain, "at least one"),
        (lambda: Chain((1.0, Constant(START)), (0.0, Constant(START))), "rise"),
        (lambda: Chain((0.0, Constant(START)), (1.0, Constant(GOAL))), "value jumps.*t = 1 s"),
        (
            lambda: Chain((0.0, MinimumJerk(START, GOAL, 2.0)), (2.0, Constant(START))),
            "value jumps",
        ),
        (lambda: Chain((0.0, Constant(START)), (1.0, Constant(1.0))), "value jumps"),
    ],
)
def test_unusable_references_say_what_is_wrong(build, reason):
    with pytest.raises(InputError, match=reason):
        build()


def test_a_chain_refuses_a_jump_of_the_velocity():
    circle = Circle(START, 0.2, 1.0)
    stop = circle(2.5)
    with pytest.raises(InputError, match="velocity jumps"):
        Chain((0.0, circle), (2.5, Constant(stop.x)))


def test_importing_tasks_loads_no_slow_library():
    code = "import sys, opspace.tasks; print([m for m in ('scipy', 'ruckig') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
