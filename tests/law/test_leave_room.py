"""Levels below leave those above what is left of a joint's limit, and take nothing from them."""

import itertools
import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from opspace.law import Stacks, Weighted, leave_room, motions_left, wants_more
from opspace.law.hierarchy import Level, WhitenedTask
from opspace.law.scalars import LEFT, ROOM_CLEANINGS, ROOM_SOFT, UNSEEN, level_weight

SEEDS = st.integers(0, 2**32 - 1)
INF = np.inf


def problem(seed):
    """An inertia, two levels above damping, an acceleration, and bounds near for some joints."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 9))
    B = rng.normal(size=(n, n))
    L = np.linalg.cholesky(B @ B.T + 0.1 * np.eye(n))
    sizes = rng.integers(1, max(2, n // 2), 2)
    whitened = [WhitenedTask(rng.normal(size=(m, n)), np.zeros(m)) for m in sizes]
    near = rng.random((2, n)) < 0.4
    lower = np.where(near[0], -rng.exponential(1.0, n), -INF)
    upper = np.where(near[1], rng.exponential(1.0, n), INF)
    return L, whitened, 10.0 * rng.normal(size=n), lower, upper


def stacks_of(whitened, corners, damped=True):
    levels = [Level(i, frozenset([i])) for i in range(len(whitened))]
    blend = [Weighted(w, frozenset(k)) for w, k in corners]
    return Stacks(whitened, levels, blend, [f"task {i}" for i in range(len(whitened))], damped)


@given(seed=SEEDS)
def test_levels_above_lose_nothing(seed):
    L, whitened, wanted, lower, upper = problem(seed)
    found = leave_room(L, stacks_of(whitened, [(1.0, {0, 1})]), wanted, lower, upper)
    change = L.T @ (found.acceleration - wanted)
    size = np.linalg.norm(L.T @ wanted)
    assert np.linalg.norm(whitened[0].J @ change) < 1e-3 * size * np.linalg.norm(whitened[0].J)
    if not wants_more(wanted, lower, upper):
        assert np.all(found.upper == 0.0)
        assert np.all(found.lower == 0.0)


@given(seed=SEEDS)
def test_what_levels_below_add_is_half_of_what_a_limit_allows(seed):
    """Where they move the joint by more than what is softened away, and no other is near its limit."""
    L, whitened, wanted, lower, upper = problem(seed)
    lower[:], upper[1:] = -INF, INF
    stacks = stacks_of(whitened[:1], [(1.0, {0})])
    found = leave_room(L, stacks, wanted, lower, upper)
    P = motions_left(stacks, 1, len(L), weighed=False)
    joints = np.linalg.inv(L).T
    above = joints @ (L.T @ found.acceleration - P @ (L.T @ found.acceleration))
    mobile = np.sum((joints @ P) * joints, axis=1) / np.sum(joints**2, axis=1)
    size = np.max(np.abs(joints @ L.T @ wanted)) + np.max(np.abs(found.acceleration))
    soft = 2.0 * size * (ROOM_SOFT / (mobile + ROOM_SOFT)) ** ROOM_CLEANINGS + 1e-3 * size
    for sign, most in ((1.0, upper), (-1.0, -lower)):
        room = LEFT * np.maximum(most, 0.0) + np.maximum(sign * above, 0.0)
        assert np.all(sign * found.acceleration <= room + soft)


@given(seed=SEEDS, share=st.floats(1e-9, 1e-6))
def test_a_level_that_has_hardly_come_changes_hardly_anything(seed, share):
    """Not even where the levels below hardly move the joint, so that more turns would take more."""
    L, whitened, wanted, lower, upper = problem(seed)
    n, rng = len(L), np.random.default_rng(seed)
    joint = np.linalg.inv(L).T[0]
    row = joint / np.linalg.norm(joint) + 0.05 * rng.normal(size=n) / np.sqrt(n)
    whitened = [WhitenedTask(row[None], np.zeros(1)), whitened[1]]
    wanted[0], upper[0] = 30.0, 1.0
    without = leave_room(L, stacks_of(whitened[:1], [(1.0, {0})]), wanted, lower, upper)
    coming = stacks_of(whitened, [(1.0 - share, {0}), (share, {0, 1})])
    found = leave_room(L, coming, wanted, lower, upper)
    difference = np.linalg.norm(L.T @ (found.acceleration - without.acceleration))
    assert difference <= 1e4 * share * np.linalg.norm(L.T @ wanted)


@given(seed=SEEDS)
def test_the_answer_hardly_changes_where_the_wish_hardly_does(seed):
    L, whitened, wanted, lower, upper = problem(seed)
    stacks = stacks_of(whitened, [(0.4, {0}), (0.6, {0, 1})])
    other = wanted + 1e-6 * np.linalg.inv(L).T @ np.ones(len(L)) / np.sqrt(len(L))
    found = [leave_room(L, stacks, x, lower, upper).acceleration for x in (wanted, other)]
    assert np.linalg.norm(L.T @ (found[1] - found[0])) < 1e-6 * 50.0


@given(seed=SEEDS)
def test_what_is_left_is_the_inverse_of_what_is_counted(seed):
    """Found row by row, with as many digits for rows that see much as the inverse has for none."""
    _, whitened, *_ = problem(seed)
    n = whitened[0].J.shape[1]
    stacks = stacks_of(whitened, [(0.3, {0}), (0.7, {0, 1})])
    for weighed in (False, True):
        found = motions_left(stacks, 1, n, weighed=weighed)
        upper, other = (one.J.T @ one.J for one in whitened)
        first = np.eye(n) + UNSEEN * upper
        both = first + (level_weight(0) * other if weighed else 0.0)
        want = 0.3 * np.linalg.inv(first) + 0.7 * np.linalg.inv(both)
        np.testing.assert_allclose(found, want, atol=1e-9)
        assert np.all(np.linalg.eigvalsh(found) > -1e-15)


@given(seed=SEEDS)
def test_rows_of_any_length_are_left_alone_in_the_digits_there_are(seed):
    """Rows 10⁹ times as long as others, with which no matrix of all has an inverse in its digits."""
    L, whitened, wanted, lower, upper = problem(seed)
    found = []
    for factor in (1e4, 1e9):
        longer = [WhitenedTask(factor * one.J, one.f) for one in whitened[:1]]
        found.append(leave_room(L, stacks_of(longer, [(1.0, {0})]), wanted, lower, upper))
    size = np.linalg.norm(L.T @ wanted)
    change = L.T @ (found[0].acceleration - found[1].acceleration)
    assert np.linalg.norm(change) < 1e-6 * size
    np.testing.assert_allclose(found[0].upper, found[1].upper, rtol=1e-5, atol=1e-6 * size)


def moving(rng, n, shares, before, after):
    """Tasks that are there in part, the last of them on its way from one level to another."""
    whitened = [WhitenedTask(rng.normal(size=(2, n)), np.zeros(2)) for _ in shares[:-1]]
    whitened += [WhitenedTask(rng.normal(size=(1, n)), np.zeros(1))] * 2
    levels = [set() for _ in range(3)]
    for k in range(len(shares) - 1):
        levels[k % 3].add(k)
    levels[before].add(len(shares) - 1)
    levels[after].add(len(shares))
    blend = []
    for on in itertools.product((0, 1), repeat=len(shares)):
        weight = math.prod(h if here else 1.0 - h for h, here in zip(shares, on, strict=True))
        members = {k for k, here in enumerate(on[:-1]) if here} | {len(shares) - 1 + on[-1]}
        blend += [Weighted(weight, frozenset(members))] if weight > 0.0 else []
    names = [f"task {k}" for k in range(len(shares))] + [f"task {len(shares) - 1}"]
    return Stacks(
        whitened, [Level(i, frozenset(m)) for i, m in enumerate(levels)], blend, names, True
    )


@given(seed=SEEDS, weighed=st.booleans(), first=st.integers(1, 3))
def test_what_is_left_moves_no_faster_than_activations(seed, weighed, first):
    """Also where rows of one task are nearly those of another, and where activations cross."""
    n, rng = 6, np.random.default_rng(seed)
    shares = rng.random(5)
    shares[1] = shares[0]
    steps = 1e-7 * rng.normal(size=5)
    other = np.clip(shares + steps, 0.0, 1.0)
    before, after = rng.choice(3, 2, replace=False)
    left = []
    for now in (shares, other):
        stacks = moving(np.random.default_rng(seed), n, now, before, after)
        stacks.whitened[1].J[0] = stacks.whitened[0].J[0] + 1e-4 * stacks.whitened[1].J[0]
        left.append(motions_left(stacks, first, n, weighed=weighed))
    most = np.sum(np.abs(other - shares))
    # A level more below counts ten times, and a task may be on its way over two levels.
    slope = 2.0 + (3.0 * math.log(10.0) if weighed else 0.0)
    assert np.linalg.norm(left[1] - left[0], 2) <= slope * most + 1e-14


@given(seed=SEEDS, weighed=st.booleans(), first=st.integers(1, 3))
def test_activations_of_0_and_1_leave_what_the_stack_leaves(seed, weighed, first):
    n, rng = 6, np.random.default_rng(seed)
    shares = rng.integers(0, 2, 5).astype(float)
    before, after = rng.choice(3, 2, replace=False)
    stacks = moving(rng, n, shares, before, after)
    ((_, present),) = stacks.corners
    counted, below = np.eye(n), 0
    for place, level in reversed(list(enumerate(stacks.levels))):
        here = level.members & present
        weight = UNSEEN if place < first else level_weight(below) if weighed else 0.0
        counted += weight * sum(stacks.whitened[k].J.T @ stacks.whitened[k].J for k in here)
        below += bool(here)
    found = motions_left(stacks, first, n, weighed=weighed)
    np.testing.assert_allclose(found, np.linalg.inv(counted), atol=1e-9)


@given(seed=SEEDS, share=st.floats(0.0, 1.0))
def test_a_task_that_changes_places_is_never_unseen(seed, share):
    """On its way between two levels it is at one of them, whatever else is on its way."""
    rng = np.random.default_rng(seed)
    stacks = moving(rng, 6, [*rng.random(4), share], 0, 1)
    left = motions_left(stacks, 2, 6, weighed=False)
    row = stacks.whitened[-1].J[0]
    assert row @ left @ row <= 1.0 / UNSEEN + 1e-12
