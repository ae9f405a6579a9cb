"""The projection behind the law: what can be kept is kept, and by the nearest acceleration there is."""

import daqp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.kernels.inertia import factor
from opspace.kernels.projection import nearest_acceleration as compiled
from opspace.kernels.projection import project_on_bounds
from opspace.law import nearest_acceleration, task_metric
from opspace.law.hierarchy import Level, WhitenedTask
from opspace.law.nearest import nearest_point
from opspace.law.scalars import CLEANINGS, HARD, SOFT
from opspace.plan.distance_records import DISTANCES
from opspace.plan.memory import make_inertia
from opspace.plan.records import BOUNDS

INF = np.inf


def problem(seed, contradictory=False):
    """Inertia, metric, acceleration and bounds, some infinite; kept by some acceleration if possible."""
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
    J = rng.normal(size=(int(rng.integers(0, 5)), n))
    return (
        np.linalg.cholesky(A),
        np.eye(n) + 10.0 ** rng.uniform(-1.0, 2.0) * J.T @ J,
        rng.normal(0.0, 30.0, n),
        np.where(there, lower, -INF),
        np.where(rng.random(n) < 0.7, upper, INF),
        np.where(driven, least, -INF),
        np.where(driven, most, INF),
    )


def by_solver(L, W, acceleration, lower, upper, least, most):
    A = L @ L.T
    big = 1e30
    metric = L @ W @ L.T
    x, _, flag, _ = daqp.solve(
        metric,
        -metric @ acceleration,
        np.concatenate([np.eye(len(A)), A]),
        np.clip(np.concatenate([upper, most]), -big, big),
        np.clip(np.concatenate([lower, least]), -big, big),
        np.zeros(2 * len(A), dtype=np.intc),
    )
    assert flag == 1
    return x


def normals(L, W, lower, upper, least, most):
    """Every finite bound as unit normal · z <= bound, z = Cᵀ q̈."""
    C = L @ np.linalg.cholesky(W)
    rows = np.concatenate([np.linalg.inv(C).T, np.linalg.solve(C, L @ L.T).T])
    rows, bounds = np.concatenate([rows, -rows]), np.concatenate([upper, most, -lower, -least])
    there = np.isfinite(bounds)
    size = np.linalg.norm(rows[there], axis=1)
    softness = np.tile(np.repeat([SOFT, HARD], len(L)), 2)[there]
    return C, rows[there] / size[:, None], bounds[there] / size, softness


seeds = st.integers(0, 2**32 - 1)


@given(seeds, st.booleans())
def test_a_bound_is_exceeded_by_its_softness_times_what_holds_it(seed, contradictory):
    """The conditions of Karush, Kuhn and Tucker: no other point is nearer, whatever the numbers."""
    L, W, start, lower, upper, least, most = problem(seed, contradictory)
    C, unit, bounds, softness = normals(L, W, lower, upper, least, most)
    y, multipliers = nearest_point(C.T @ start, unit, bounds, softness)
    assert np.all(multipliers >= 0.0)
    assert np.allclose(y + unit.T @ multipliers, C.T @ start)
    over = unit @ y - bounds - softness * multipliers
    size = 1.0 + np.max(np.abs(C.T @ start)) + np.max(np.abs(bounds), initial=0.0)
    size += np.sum(multipliers)
    assert np.all(over <= 1e-9 * size)
    assert np.all(np.abs(over[multipliers > 0.0]) <= 1e-9 * size)
    answer = nearest_acceleration(L, W, start, lower, upper, least, most)
    for _ in range(CLEANINGS - 1):
        y, _ = nearest_point(y, unit, bounds, softness)
    assert np.allclose(C.T @ answer.acceleration, y, atol=1e-9 * size)


@given(seeds)
def test_it_is_the_nearest_in_the_metric(seed):
    """As far as softness lets it be: by its share of the way, and more where normals are nearly one."""
    L, W, start, *bounds = problem(seed)
    C, unit, bound, softness = normals(L, W, *bounds)
    _, multipliers = nearest_point(C.T @ start, unit, bound, softness)
    ours = nearest_acceleration(L, W, start, *bounds).acceleration
    theirs = by_solver(L, W, start, *bounds)
    held = unit[multipliers > 0.0]
    share = SOFT * np.linalg.norm(np.linalg.pinv(held), 2) ** 2 if held.size else 0.0
    far, nearest = (np.linalg.norm(C.T @ (x - start)) for x in (ours, theirs))
    assert far - nearest <= share * nearest + 1e-6
    assert np.linalg.norm(C.T @ (ours - theirs)) <= share * nearest + 1e-6


@given(seeds, st.booleans())
def test_compiled_is_readable(seed, contradictory):
    L, W, start, *bounds = problem(seed, contradictory)
    x = start.copy()
    given_ = BOUNDS.make({"n": x.size, "distances": 0})
    none = DISTANCES.make({"n": x.size, "balls": 0, "sets": 0, "faces": 0, "distances": 0})
    for array, values in zip(given_, bounds, strict=False):
        array[:] = values
    inertia = make_inertia(np.arange(x.size) - 1)
    assert factor(L @ L.T, inertia.handle())
    change = np.linalg.solve(
        inertia.L[:, : len(L)].T, L
    )  # it factors the inertia from the other end
    given_.W[:] = change @ W @ change.T
    compiled(inertia.handle(), x, given_.handle(), none.handle())
    readable = nearest_acceleration(L, W, start, *bounds)
    R = np.linalg.cholesky(W).T @ L.T
    size = 1.0 + np.linalg.norm(R @ start) + np.linalg.norm(R @ readable.acceleration)
    assert np.linalg.norm(R @ (x - readable.acceleration)) <= 1e-7 * size
    # What softness shares between bounds that contradict each other is known to fewer digits.
    taken = np.concatenate([readable.upper, readable.lower])
    assert np.allclose(given_.taken[: 2 * x.size], taken, rtol=1e-3, atol=1e-3 * size)


@given(seeds)
def test_an_acceleration_within_bounds_is_left_alone(seed):
    L, W, _, *bounds = problem(seed)
    middle = nearest_acceleration(L, W, np.zeros(len(L)), *bounds).acceleration
    again = nearest_acceleration(L, W, middle, *bounds).acceleration
    R = np.linalg.cholesky(W).T @ L.T
    assert np.linalg.norm(R @ (again - middle)) <= 1e-5 * (1.0 + np.linalg.norm(R @ middle))


@given(seeds, st.booleans())
@settings(max_examples=60)
def test_answers_are_no_further_apart_than_questions(seed, contradictory):
    L, W, start, *bounds = problem(seed, contradictory)
    other = start + np.random.default_rng(seed).normal(0.0, 1.0, start.size)
    one, two = (nearest_acceleration(L, W, x, *bounds).acceleration for x in (start, other))
    R = np.linalg.cholesky(W).T @ L.T
    assert np.linalg.norm(R @ (one - two)) <= np.linalg.norm(R @ (start - other)) * 1.000001 + 1e-6


def test_contradicting_bounds_share_the_excess():
    L = np.eye(2)
    lower, upper, free = np.array([5.0, -INF]), np.array([1.0, INF]), np.full(2, INF)
    x = nearest_acceleration(L, L, np.array([9.0, 2.0]), lower, upper, -free, free).acceleration
    assert x == pytest.approx([3.0, 2.0], abs=1e-5)


def test_the_motors_are_harder_than_what_joints_may_do():
    """A joint that must brake more than its motor can, brakes with all that the motor has."""
    L, one = np.array([[2.0]]), np.ones(1)
    found = nearest_acceleration(
        L, np.eye(1), 0.0 * one, -INF * one, -50.0 * one, -40.0 * one, 40.0 * one
    )
    assert found.acceleration == pytest.approx([-10.0], rel=1e-3)
    assert found.motors


def test_without_bounds_nothing_changes():
    free = np.full(3, INF)
    x, one = np.array([1.0, 2.0, 3.0]), np.eye(3)
    assert np.array_equal(
        nearest_acceleration(one, one, x, -free, free, -free, free).acceleration, x
    )


def test_the_lower_level_gives_way():
    """A bound across both levels is paid for by the lower one, up to the ratio of their weights."""
    rng = np.random.default_rng(3)
    J = np.eye(4)[:2], np.eye(4)[2:]
    levels = [Level(0, frozenset([0])), Level(1, frozenset([1]))]
    whitened = [WhitenedTask(rows, np.zeros(2)) for rows in J]
    W = task_metric(whitened, levels, [1.0, 1.0], 4)
    row = rng.normal(size=(1, 4))
    row /= np.linalg.norm(row)
    C = np.linalg.cholesky(W)
    unit = np.linalg.solve(C, row.T).T
    size = np.linalg.norm(unit)
    z, _ = nearest_point(np.zeros(4), unit / size, np.array([-1.0]) / size, np.array([1e-12]))
    moved = np.linalg.solve(C.T, z)
    assert row @ moved == pytest.approx(-1.0)
    price = np.abs(moved / row[0])
    assert price[:2] == pytest.approx(price[2] * 2.0 / 11.0)


@given(seeds)
def test_a_level_that_comes_with_nothing_changes_nothing(seed):
    """The metric is continuous in the activations although levels come and go."""
    rng = np.random.default_rng(seed)
    whitened = [WhitenedTask(rng.normal(size=(2, 5)), np.zeros(2)) for _ in range(3)]
    levels = [Level(p, frozenset([p])) for p in range(3)]
    h = rng.uniform(size=3)
    for k in range(3):
        gone = [level for level in levels if level.priority != k]
        h[k] = 0.0
        absent = task_metric(whitened, gone, h, 5)
        assert np.array_equal(task_metric(whitened, levels, h, 5), absent)
        h[k] = 1e-9
        assert np.allclose(task_metric(whitened, levels, h, 5), absent, rtol=1e-6, atol=1e-6)


@given(seeds)
def test_bounds_that_are_nearly_one_are_kept_as_one_however_hard_they_are(seed):
    """Softer than nothing but rounding: what one adds to those that it is nearly one with is noise."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 6))
    rows = rng.normal(size=(n, n))
    x, most = rng.normal(0.0, 10.0, n), rng.normal(0.0, 10.0, n)
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    beside = np.tile(rows, (4, 1)) + rng.normal(0.0, 1e-10, (4 * n, n))
    bounds = BOUNDS.make({"n": n, "distances": 0})
    bounds.normal[:] = beside / np.linalg.norm(beside, axis=1)[:, None]
    bounds.bound[:] = np.tile(most, 4)
    bounds.softness[:], bounds.factor[:] = 1e-18, np.nan
    bounds.x[:] = x
    project_on_bounds(4 * n, n, 0, bounds.normal, bounds.handle())
    want, _ = nearest_point(x, rows, most, np.full(n, HARD))
    size = (1.0 + np.linalg.norm(x) + np.linalg.norm(want)) * np.linalg.cond(rows) ** 2
    assert np.linalg.norm(bounds.y - want) <= 1e-7 * size
