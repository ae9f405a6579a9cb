"""Torque limits that keep priority."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from opspace.law import Motors, TaskSet, blended_torque, corners
from opspace.law.nearest import make_room
from opspace.law.scalars import EAGER, SHARE, room_for

SEEDS = st.integers(0, 2**32 - 1)


def random_case(seed, levels=3, fewest=2):
    """An arm, task sets on levels of their own, and motors that give a part of what they ask for."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(fewest, 8))
    A = rng.normal(size=(n, n))
    M = A @ A.T + 0.3 * np.eye(n)
    tasks = [
        TaskSet(rng.normal(size=(2, n)), 10 * rng.normal(size=2), k, float(rng.choice([1.0, 0.4])))
        for k in range(levels)
    ]
    L = np.linalg.cholesky(M)
    limit = rng.uniform(0.2, 40.0, n)
    limit[rng.random(n) < 0.1] = np.inf
    start = rng.uniform(-0.8, 0.8, n) * np.where(np.isfinite(limit), limit, 10.0)
    return L, tasks, Motors(L, start, limit)


def limited(L, tasks, motors):
    blend = corners([task.activation for task in tasks], "idv")
    tau, info = blended_torque(L, tasks, blend, motors=motors)
    return motors.start + tau, [level.scale for level in info.levels]


@given(SEEDS)
def test_the_torque_is_inside_the_limits(seed):
    L, tasks, motors = random_case(seed)
    tau, scale = limited(L, tasks, motors)
    finite = np.isfinite(motors.limit)
    assert np.all(np.abs(tau[finite]) <= motors.limit[finite] * (1.0 + 1e-9))
    assert all(0.0 <= s <= 1.0 for s in scale)


@given(SEEDS)
def test_what_fits_is_left_alone(seed):
    L, tasks, motors = random_case(seed)
    blend = corners([task.activation for task in tasks], "idv")
    free, _ = blended_torque(L, tasks, blend)
    tau, scale = limited(L, tasks, motors._replace(limit=np.full(len(L), 1e6)))
    np.testing.assert_allclose(tau, motors.start + free, rtol=1e-9, atol=1e-9)
    assert scale == [1.0] * len(scale)


@given(SEEDS)
def test_no_level_gives_way_to_one_below(seed):
    L, tasks, motors = random_case(seed)
    tasks = [task.replace(activation=1.0) for task in tasks]
    _, scale = limited(L, tasks, motors)
    for count in range(1, len(tasks)):
        _, above = limited(L, tasks[:count], motors)
        np.testing.assert_allclose(above, scale[:count], rtol=1e-9)


def free(L, tasks):
    """The torque of the tasks on motors that give anything."""
    blend = corners([task.activation for task in tasks], "idv")
    return blended_torque(L, tasks, blend)[0]


def did(L, task, torque):
    """What a torque beside the start accelerates of a task."""
    return task.J @ np.linalg.solve(L @ L.T, torque)


@given(SEEDS)
def test_every_level_is_scaled_towards_what_it_asks_for_and_keeps_those_above(seed):
    """J₁ q̈ = s₁ f₁ with both levels, and J₂ q̈ is s₂ of the way from what level 1 does to f₂."""
    L, tasks, motors = random_case(seed, levels=2, fewest=4)
    first, second = (task.replace(activation=1.0) for task in tasks)
    alone, _ = limited(L, [first], motors)
    tau, (s1, s2) = limited(L, [first, second], motors)
    before, after = did(L, second, alone - motors.start), did(L, second, tau - motors.start)
    size = 1.0 + np.abs(first.f).max() + np.abs(second.f).max() + np.abs(before).max()
    for torque in (alone, tau):
        got = did(L, first, torque - motors.start)
        np.testing.assert_allclose(got, s1 * first.f, rtol=0.0, atol=1e-7 * size)
    wanted = before + s2 * (second.f - before)
    np.testing.assert_allclose(after, wanted, rtol=0.0, atol=1e-7 * size)


@given(SEEDS)
def test_no_level_gets_less_than_without_help(seed):
    L, tasks, motors = random_case(seed, levels=1, fewest=3)
    (task,) = (task.replace(activation=1.0) for task in tasks)
    _, (s,) = limited(L, [task], motors)
    assert s >= room_for(free(L, [task]), motors.start, motors.limit) * (1.0 - 1e-9)


@given(SEEDS)
def test_room_is_made_in_the_best_way(seed):
    """min EAGER² ‖step‖² (2 − s)² + ‖z‖²: the gradient leads away from everything that is allowed."""
    rng = np.random.default_rng(seed)
    n, r = int(rng.integers(2, 8)), int(rng.integers(0, 5))
    torque, limit = rng.uniform(-0.8, 0.8, n), np.ones(n)
    step, part, beside = rng.normal(size=n), 3.0 * rng.normal(size=n), rng.normal(size=(n, r))
    s, z = make_room(step, part, beside, torque, limit)
    assert 0.0 <= s <= 1.0
    up, down = SHARE * (limit - torque), SHARE * (limit + torque)
    used = s * part + beside @ z
    assert np.all(used <= up + 1e-9)
    assert np.all(used >= -down - 1e-9)
    for _ in range(50):
        other, y = rng.uniform(0.0, 1.0), rng.normal(size=r)
        used = other * part + beside @ y
        fits = min(1.0, np.min(np.where(used > 0.0, up, down) / np.abs(used)))
        weight = EAGER**2 * float(step @ step)
        slope = -weight * (2.0 - s) * (fits * other - s) + z @ (fits * y - z)
        assert slope >= -1e-6 * (weight + z @ z)


@given(SEEDS, st.floats(0.05, 0.9))
def test_a_level_can_be_exact_below_one_that_is_scaled(seed, part):
    """One motor stops the first level; the second one hardly needs it and gets all it asks for."""
    L, tasks, _ = random_case(seed, levels=2, fewest=4)
    n = len(L)
    first, second = (task.replace(activation=1.0) for task in tasks)
    gamma1 = free(L, [first])
    used = int(np.argmax(np.abs(gamma1)))
    limit = np.full(n, 1e6)
    limit[used] = part * np.abs(gamma1[used]) / SHARE
    motors = Motors(L, np.zeros(n), limit)
    above, (s1,) = limited(L, [first], motors)
    wish = second.f / np.linalg.norm(second.f)
    unit = free(L, [first.replace(f=0.0 * first.f), second.replace(f=wish)])
    size = 0.5 * SHARE * (1.0 - SHARE) * limit[used] / max(abs(unit[used]), 1e-3)
    second = second.replace(f=did(L, second, above) + size * wish)
    tau, scale = limited(L, [first, second], motors)
    np.testing.assert_allclose(scale, [s1, 1.0], rtol=1e-9)
    for task, f in ((first, s1 * first.f), (second, second.f)):
        np.testing.assert_allclose(
            did(L, task, tau), f, rtol=0.0, atol=1e-6 * (1.0 + np.abs(f).max())
        )


@settings(max_examples=15)
@given(SEEDS)
def test_room_is_made_continuously(seed):
    """Looked at ever closer, the steepest place of a path of wishes is a slope and no jump."""
    L, tasks, motors = random_case(seed, levels=2, fewest=4)
    ends = np.random.default_rng(seed).normal(size=(2, 2, 2)) * 20.0

    def at(x):
        wishes = (1.0 - x) * ends[0] + x * ends[1]
        return limited(L, [t.replace(f=f) for t, f in zip(tasks, wishes, strict=True)], motors)[0]

    start, end, steps = 0.0, 1.0, []
    for _ in range(4):
        places = np.linspace(start, end, 51)
        moved = np.abs(np.diff([at(x) for x in places], axis=0)).max(axis=1)
        steepest = int(np.argmax(moved))
        steps.append(moved[steepest])
        start, end = places[max(steepest - 1, 0)], places[min(steepest + 2, 50)]
    assert steps[-1] <= 0.01 * steps[0] + 1e-9


@given(SEEDS)
def test_it_is_continuous_also_where_a_joint_is_used_up(seed):
    """A level below changes sign at a joint that the one above has taken to its share."""
    rng = np.random.default_rng(seed)
    n = 3
    limit = rng.uniform(10.0, 50.0, n)
    first = 5.0 * limit * rng.choice([-1.0, 1.0], n)
    ends = rng.normal(size=(2, n)) * limit

    def at(x):
        torque = room_for(first, np.zeros(n), limit) * first
        second = (1.0 - x) * ends[0] + x * ends[1]
        return torque + room_for(second, torque, limit) * second

    largest = np.max(np.abs(ends))
    for count in (400, 800):
        path = np.array([at(x) for x in np.linspace(0.0, 1.0, count + 1)])
        # The second level has at least a (1 − SHARE)-th of a limit, and moves by 1/count of its ends.
        slope = 1.0 + 2.0 * largest / ((1.0 - SHARE) * SHARE * np.min(limit))
        assert np.max(np.abs(np.diff(path, axis=0))) <= 1.01 * slope * 2.0 * largest / count


def test_an_empty_level_takes_nothing():
    torque, limit = np.array([1.0, -2.0]), np.array([2.0, 2.0])
    assert room_for(np.zeros(2), torque, limit) == 1.0
    assert room_for(np.array([0.0, -1.0]), torque, limit) == 0.0
