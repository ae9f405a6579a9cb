"""Torque limits that keep priority."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from opspace.law import Motors, TaskSet, blended_torque, corners
from opspace.law.scalars import SHARE, room_for

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


@given(SEEDS)
def test_every_level_is_that_of_the_law_above_what_was_left_of_the_others(seed):
    """Γ = Γ₀ + s₁ γ₁ + s₂ γ₂, with γ₂ for a first level that asks for s₁ f₁ from the beginning."""
    L, tasks, motors = random_case(seed, levels=2, fewest=3)
    first, second = (task.replace(activation=1.0) for task in tasks)
    tau, (s1, s2) = limited(L, [first, second], motors)
    gamma1 = free(L, [first])
    gamma2 = free(L, [first.replace(f=s1 * first.f), second]) - s1 * gamma1
    scale = 1.0 + np.abs(gamma1).max() + np.abs(gamma2).max()
    np.testing.assert_allclose(
        tau, motors.start + s1 * gamma1 + s2 * gamma2, rtol=0.0, atol=1e-9 * scale
    )
    assert np.isclose(s1, room_for(gamma1, motors.start, motors.limit), rtol=1e-9)
    assert np.isclose(s2, room_for(gamma2, motors.start + s1 * gamma1, motors.limit), rtol=1e-6)


@given(SEEDS, st.floats(0.05, 0.9))
def test_a_level_can_be_exact_below_one_that_is_scaled(seed, part):
    """One motor stops the first level; the second one hardly needs it and gets all it asks for."""
    L, tasks, _ = random_case(seed, levels=2, fewest=4)
    n = len(L)
    M = L @ L.T
    first, second = (task.replace(activation=1.0) for task in tasks)
    gamma1 = free(L, [first])
    used = int(np.argmax(np.abs(gamma1)))
    limit = np.full(n, 1e6)
    limit[used] = part * np.abs(gamma1[used]) / SHARE
    wish = second.f / np.linalg.norm(second.f)
    unit = free(L, [first.replace(f=0.0 * first.f), second.replace(f=wish)])
    size = 0.5 * SHARE * (1.0 - SHARE) * limit[used] / max(abs(unit[used]), 1e-3)
    did = second.J @ np.linalg.solve(M, part * gamma1)
    second = second.replace(f=did + size * wish)
    tau, scale = limited(L, [first, second], Motors(L, np.zeros(n), limit))
    np.testing.assert_allclose(scale, [part, 1.0], rtol=1e-9)
    for task, f in ((first, part * first.f), (second, second.f)):
        got = task.J @ np.linalg.solve(M, tau)
        np.testing.assert_allclose(got, f, rtol=0.0, atol=1e-6 * (1.0 + np.abs(f).max()))


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
