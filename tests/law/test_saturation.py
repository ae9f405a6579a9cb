"""Torque limits that keep priority."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from opspace.law import Motors, TaskSet, blended_torque, corners
from opspace.law.saturation import SHARE, room_for

SEEDS = st.integers(0, 2**32 - 1)


def random_case(seed, levels=3):
    """An arm, task sets on levels of their own, and motors that give a part of what they ask for."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 8))
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


@given(SEEDS)
def test_levels_below_know_what_a_scaled_level_does(seed):
    """The second level gets what it asks for, whatever the first one was left of its own."""
    L, tasks, motors = random_case(seed, levels=2)
    n = len(L)
    if n < 4:
        return
    tasks = [task.replace(activation=1.0) for task in tasks]
    # Motors that stop the first level and have plenty for the second one.
    first, _ = limited(L, tasks[:1], motors._replace(start=np.zeros(n)))
    tau, scale = limited(L, tasks, motors._replace(start=np.zeros(n)))
    if scale[0] < 1.0 and scale[1] == 1.0:
        M = L @ L.T
        got = tasks[1].J @ np.linalg.solve(M, tau)
        np.testing.assert_allclose(got, tasks[1].f, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(
            tasks[0].J @ np.linalg.solve(M, tau - first), 0.0, atol=1e-7 * np.abs(tau).max()
        )


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
