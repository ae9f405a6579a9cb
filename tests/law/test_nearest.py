"""The last line behind joint limits: a projection that keeps what can be kept."""

import daqp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.kernels.inertia import factor
from opspace.kernels.projection import nearest_acceleration as compiled
from opspace.law import excess, nearest_acceleration
from opspace.plan.memory import make_inertia
from opspace.plan.records import BOUNDS

INF = np.inf


def problem(seed, contradictory=False):
    """Inertia, acceleration and bounds, some of them infinite; kept by some acceleration if possible."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 10))
    B = rng.normal(size=(n, n))
    A = B @ B.T + 0.1 * np.eye(n)
    possible = rng.normal(0.0, 10.0, n)
    there, driven = rng.random((2, n)) < 0.7
    lower, upper = (possible + s * rng.exponential(10.0, n) for s in (-1.0, 1.0))
    if contradictory:
        lower = lower + 30.0
    torque = A @ possible
    least, most = (torque + s * rng.exponential(20.0, n) for s in (-1.0, 1.0))
    return (
        np.linalg.cholesky(A),
        rng.normal(0.0, 30.0, n),
        np.where(there, lower, -INF),
        np.where(rng.random(n) < 0.7, upper, INF),
        np.where(driven, least, -INF),
        np.where(driven, most, INF),
    )


def by_solver(L, acceleration, lower, upper, least, most):
    A = L @ L.T
    big = 1e30
    x, _, flag, _ = daqp.solve(
        A,
        -A @ acceleration,
        np.concatenate([np.eye(len(A)), A]),
        np.clip(np.concatenate([upper, most]), -big, big),
        np.clip(np.concatenate([lower, least]), -big, big),
        np.zeros(2 * len(A), dtype=np.intc),
    )
    assert flag == 1
    return x


seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_bounds_that_can_be_kept_are_kept(seed):
    L, start, lower, upper, least, most = problem(seed)
    x = nearest_acceleration(L, start, lower, upper, least, most)
    assert excess(x, lower, upper) < 1e-4
    assert excess(L @ L.T @ x, least, most) < 1e-6


@given(seeds)
def test_it_is_the_nearest_in_the_inertia_metric(seed):
    given_ = problem(seed)
    ours, theirs = nearest_acceleration(*given_), by_solver(*given_)
    L, start = given_[0], given_[1]
    ours_far, theirs_far = (np.linalg.norm(L.T @ (x - start)) for x in (ours, theirs))
    assert ours_far <= theirs_far * (1.0 + 1e-4) + 1e-4
    assert np.allclose(ours, theirs, rtol=1e-3, atol=1e-2)


@given(seeds, st.booleans())
def test_compiled_is_readable(seed, contradictory):
    L, start, *bounds = problem(seed, contradictory)
    x = start.copy()
    given_ = BOUNDS.make({"n": x.size})
    for array, values in zip(given_, bounds, strict=False):
        array[:] = values
    inertia = make_inertia(np.arange(x.size) - 1).handle()
    assert factor(L @ L.T, inertia)
    compiled(inertia, x, given_.handle())
    readable = nearest_acceleration(L, start, *bounds)
    assert np.allclose(x, readable, rtol=1e-6, atol=1e-5)


@given(seeds)
def test_an_acceleration_within_bounds_is_left_alone(seed):
    L, _, lower, upper, least, most = problem(seed)
    middle = nearest_acceleration(L, np.zeros(len(L)), lower, upper, least, most)
    again = nearest_acceleration(L, middle, lower, upper, least, most)
    assert np.allclose(again, middle, rtol=1e-5, atol=1e-4)


@given(seeds, st.booleans())
@settings(max_examples=60)
def test_answers_are_no_further_apart_than_questions(seed, contradictory):
    L, start, *bounds = problem(seed, contradictory)
    other = start + np.random.default_rng(seed).normal(0.0, 1.0, start.size)
    gap = nearest_acceleration(L, start, *bounds) - nearest_acceleration(L, other, *bounds)
    before = np.linalg.norm(L.T @ (start - other))
    assert np.linalg.norm(L.T @ gap) <= before * (1.0 + 1e-6) + 1e-6


def test_contradicting_bounds_share_the_excess():
    L = np.eye(2)
    lower, upper, free = np.array([5.0, -INF]), np.array([1.0, INF]), np.full(2, INF)
    x = nearest_acceleration(L, np.array([9.0, 2.0]), lower, upper, -free, free)
    assert x == pytest.approx([3.0, 2.0], abs=1e-5)


def test_the_motors_are_harder_than_what_joints_may_do():
    """A joint that must brake more than its motor can, brakes with all that the motor has."""
    L = np.array([[2.0]])
    x = nearest_acceleration(
        L, np.array([0.0]), np.array([-INF]), np.array([-50.0]), np.array([-40.0]), np.array([40.0])
    )
    assert x == pytest.approx([-10.0], rel=1e-3)


def test_without_bounds_nothing_changes():
    free = np.full(3, INF)
    x = np.array([1.0, 2.0, 3.0])
    assert np.array_equal(nearest_acceleration(np.eye(3), x, -free, free, -free, free), x)
