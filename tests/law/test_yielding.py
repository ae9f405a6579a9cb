"""Bounds that no motor can keep give way, smoothly, and take nothing with them."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.kernels.inertia import factor
from opspace.kernels.projection import nearest_acceleration as compiled
from opspace.law import nearest_acceleration
from opspace.law.nearest import softness_of_rows
from opspace.law.scalars import CREEPING, HOPEFUL, PASSING, SOFT_APART, asked_for, yielding
from opspace.plan.distance_records import DISTANCES
from opspace.plan.memory import make_inertia
from opspace.plan.records import BOUNDS
from tests.budget import examples

BRAKE = 4.0
LEAST = asked_for(10.0, BRAKE)
MOST, REACH = st.floats(-50.0, 50.0), st.floats(1e-3, 50.0)
SEEDS = st.integers(0, 2**32 - 1)


def problem(seed, rows=1):
    """Inertia, metric, acceleration and bounds on the motors, and directions for rows."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 8))
    B = rng.normal(size=(n, n))
    A = B @ B.T + 0.3 * np.eye(n)
    J = rng.normal(size=(2, n))
    L, W = np.linalg.cholesky(A), np.eye(n) + 10.0 * J.T @ J
    motors = rng.uniform(5.0, 50.0, n)
    G = rng.normal(size=(rows, n))
    return A, L, W, rng.normal(0.0, 5.0, n), motors, G / np.linalg.norm(G, axis=1)[:, None]


def answer(A, L, W, x, motors, G, most):
    n, free = x.size, np.full(x.size, np.inf)
    softness = softness_of_rows(G, most, A, motors, np.full(most.size, LEAST))
    found = nearest_acceleration(L, W, x, -free, free, -motors, motors, G, most, softness)
    assert found.acceleration.shape == (n,)
    return found.acceleration


@given(v=st.floats(0.0, 10.0))
def test_what_passes_slowly_counts_as_asking_for_less(v):
    top = HOPEFUL * BRAKE
    asked = asked_for(v, BRAKE)
    assert top * CREEPING / (PASSING + CREEPING) <= asked <= top
    assert asked <= top * (v + CREEPING) / PASSING
    assert asked <= asked_for(1.1 * v, BRAKE)


@given(most=MOST, reach=REACH)
def test_what_motors_can_keep_is_as_hard_as_ever(most, reach):
    need = 0.5 * (math.hypot(most, 2.0 * LEAST) - most)
    assert yielding(most, math.inf, LEAST) == 0.0
    assert yielding(most, 1.001 * need, LEAST) == 0.0
    assert yielding(most, reach, LEAST) >= yielding(most, 1.1 * reach, LEAST)
    assert yielding(most - 0.1, reach, LEAST) >= yielding(most, reach, LEAST)


@given(most=MOST, reach=REACH)
def test_it_has_no_step_and_no_kink(most, reach):
    h = 1e-6 * reach
    value = [yielding(most, reach + k * h, LEAST) for k in (-2, -1, 0, 1, 2)]
    before, after = (value[2] - value[0]) / 2, (value[4] - value[2]) / 2
    need = 0.5 * (math.hypot(most, 2.0 * LEAST) - most)
    # Second derivatives are at most this, on both sides of where it begins.
    curve = 24.0 * (1.0 + need / (reach - 2 * h)) ** 2 / (reach - 2 * h) ** 2
    assert abs(after - before) <= 4.0 * curve * h**2 + 1e-9 * (1.0 + value[2])


@given(seed=SEEDS, asked=st.floats(-50.0, 10.0))
@settings(max_examples=60)
def test_a_row_that_vanishes_moves_nothing(seed, asked):
    A, L, W, x, motors, G = problem(seed)
    most = np.array([asked])
    free = answer(A, L, W, x, motors, 0.0 * G, most)
    far = [np.linalg.norm(answer(A, L, W, x, motors, s * G, most) - free) for s in (1e-4, 1e-6)]
    assert far[1] <= 2e-2 * far[0] + 1e-6
    assert far[1] <= 1e-2 * (1.0 + np.linalg.norm(x))


@given(seed=SEEDS, asked=st.floats(-20.0, 5.0))
@examples(20)
def test_a_row_that_passes_through_zero_makes_no_step(seed, asked):
    """The way of a link that flies past another: its row shrinks, turns round and grows again."""
    A, L, W, x, motors, rows = problem(seed, rows=2)
    most = np.array([asked])
    steps = []
    for count in (100, 400):
        way = np.linspace(-0.1, 0.1, count)
        answers = [answer(A, L, W, x, motors, t * rows[:1] + 1e-9 * rows[1:], most) for t in way]
        steps.append(np.max(np.linalg.norm(np.diff(answers, axis=0), axis=1)))
    assert steps[1] <= 0.5 * steps[0] + 1e-6


def test_what_cannot_be_kept_does_not_take_the_other_bounds_with_it():
    """Two joints; a distance that hardly depends on the first asks for what no motor has."""
    L, free = np.eye(2), np.full(2, np.inf)
    x, motors = np.array([3.0, 2.0]), np.array([10.0, 10.0])
    upper = np.array([1.0, np.inf])
    G, most = np.array([[-1e-6, 1e-6]]), np.array([-5.0])
    softness = softness_of_rows(G, most, L, motors, np.array([LEAST]))
    found = nearest_acceleration(L, L, x, -free, upper, -motors, motors, G, most, softness)
    assert found.acceleration == pytest.approx([1.0, 2.0], abs=1e-3)
    hard = nearest_acceleration(L, L, x, -free, upper, -motors, motors, G, most)
    assert hard.acceleration[0] > 2.0  # as hard as others it pushes the joint through its bound


@given(seed=SEEDS, beyond=st.floats(0.1, 100.0))
@examples(20)
def test_a_distance_gives_way_where_it_contradicts_the_limit_of_a_joint(seed, beyond):
    """A body drives a joint against its limit: the joint stays, to a ten-thousandth of what is asked."""
    _, L, W, x, _, _ = problem(seed)
    n, free = x.size, np.full(x.size, np.inf)
    joint, upper = seed % n, free.copy()
    upper[joint] = x[joint] - 1.0
    G, most = -np.eye(n)[[joint]], np.array([-upper[joint] - beyond])
    found = nearest_acceleration(
        L, W, x, -free, upper, -free, free, G, most, np.array([SOFT_APART])
    )
    assert found.acceleration[joint] <= upper[joint] + 2e-4 * (beyond + 1.0)


def test_without_known_motors_all_rows_are_equally_hard():
    G, most = np.array([[1e-9, 0.0], [0.0, 1.0]]), np.array([-5.0, 1.0])
    least, nobody = np.full(2, LEAST), np.full(2, np.inf)
    assert softness_of_rows(G, most, np.eye(2), nobody, least).tolist() == [SOFT_APART] * 2
    nothing = softness_of_rows(0.0 * G, most, np.eye(2), nobody, least)
    assert nothing.tolist() == [np.inf, np.inf]


@given(seed=SEEDS)
def test_compiled_gives_way_as_the_readable_form_does(seed):
    rng = np.random.default_rng(seed)
    A, L, W, x, motors, G = problem(seed, rows=3)
    G *= 10.0 ** rng.uniform(-4.0, 0.5, (3, 1))
    most = rng.normal(0.0, 5.0, 3)
    sizes = {"n": x.size, "balls": 0, "sets": 0, "faces": 0, "distances": 3}
    bounds, distances = BOUNDS.make(sizes), DISTANCES.make(sizes)
    bounds.least[:], bounds.most[:] = -motors, motors
    distances.G[:], distances.most[:], distances.motors[:] = G, most, motors
    distances.asked[:] = LEAST
    inertia = make_inertia(np.arange(x.size) - 1)
    assert factor(A, inertia.handle())
    change = np.linalg.solve(
        inertia.L[:, : len(L)].T, L
    )  # it factors the inertia from the other end
    bounds.W[:] = change @ W @ change.T
    ours = x.copy()
    compiled(inertia.handle(), ours, bounds.handle(), distances.handle())
    theirs = answer(A, L, W, x, motors, G, most)
    R = np.linalg.cholesky(W).T @ L.T
    assert np.linalg.norm(R @ (ours - theirs)) <= 1e-6 * (1.0 + np.linalg.norm(R @ x))
