"""The factor of an inertia that knows the tree, on random trees."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from opspace.kernels.inertia import (
    acceleration_of,
    factor,
    torque_of,
    unit_row,
    whiten,
    whiten_rows,
    whitened_of,
)
from opspace.machine.lanes import whole
from opspace.plan.memory import make_inertia


def random_tree(seed):
    """Where each coordinate hangs, and an inertia with zeros between branches."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 12))
    ordered = rng.random() < 0.7  # branch by branch, as robot files have them
    before = np.full(n, -1)
    for a in range(1, n):
        way, b = [-1], a - 1
        while ordered and b >= 0:
            way.append(b)
            b = before[b]
        places = way if ordered else range(-1, a)
        before[a] = a - 1 if rng.random() < 0.6 else rng.choice(places)
    moves = np.zeros((n, n), bool)  # [a, b]: b moves what hangs behind a
    for a in range(n):
        b = a
        while b >= 0:
            moves[a, b] = True
            b = before[b]
    J = rng.normal(size=(3, n, n)) * moves
    return rng, before, moves, np.einsum("kab,kac->bc", J, J) + 0.1 * np.eye(n)


@given(st.integers(0, 2**32 - 1))
def test_the_factor_is_one_and_has_the_zeros_of_the_tree(seed):
    rng, before, moves, M = random_tree(seed)
    n = before.size
    inertia = make_inertia(before)
    f = inertia.handle()
    assert factor(M, f)
    U = inertia.L[:, :n].T
    size = np.max(np.abs(M))
    np.testing.assert_allclose(U @ U.T, M, rtol=0, atol=1e-12 * size)
    in_order = all(moves[:, a].sum() == inertia.end[a] - a for a in range(n))
    assert not in_order or not U[~moves.T].any()
    x = rng.normal(size=n)
    found, joint = np.zeros(n), int(rng.integers(n))
    whitened_of(f, x, found)
    np.testing.assert_allclose(found, U.T @ x, rtol=0, atol=1e-12 * size)
    torque_of(f, x, found)
    np.testing.assert_allclose(found, U @ x, rtol=0, atol=1e-12 * size)
    acceleration_of(f, found)
    np.testing.assert_allclose(U.T @ found, U @ x, rtol=0, atol=1e-9 * size)
    found[:] = x
    whiten(f, found)
    np.testing.assert_allclose(U @ found, x, rtol=0, atol=1e-9)
    rows = rng.normal(size=(4, n)) * moves[joint]
    many = np.ones((4, whole(n)))
    whiten_rows(f, joint, 1, 3, rows, many)
    np.testing.assert_allclose(many[1:3, :n] @ U.T, rows[1:3], rtol=0, atol=1e-9)
    assert not many[1:3, n:].any()
    assert (many[[0, 3]] == 1.0).all()
    np.testing.assert_array_equal(inertia.white, np.tril(inertia.white))
    unit_row(f, joint, 2.0, found)
    np.testing.assert_allclose(found @ U.T, 2.0 * np.eye(n)[joint], rtol=0, atol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_what_is_not_positive_definite_has_no_factor(seed):
    rng, before, _, M = random_tree(seed)
    a = rng.integers(before.size)
    M[a, a] = rng.choice([-1.0, 0.0, np.nan])
    assert not factor(M, make_inertia(before).handle())
