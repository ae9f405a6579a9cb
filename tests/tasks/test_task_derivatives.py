"""Every task's Jacobian, drift and command against numerical derivatives and motions."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tasks.harness import (
    TASKS,
    bound,
    numerical_drift,
    numerical_velocity,
    random_state,
    terms_at,
)


@pytest.fixture(params=list(TASKS))
def task(request, robot):
    return bound(request.param, robot)


def test_jacobian_is_the_derivative_of_the_task_value(task, robot, rng):
    for _ in range(3):
        q, v = random_state(robot, rng)
        expected = numerical_velocity(task, robot, q, v)
        J = terms_at(task, robot, q, v).J
        assert J.shape == (task.rows, robot.nv)
        np.testing.assert_allclose(J @ v, expected, rtol=1e-7, atol=1e-8)


def test_drift_is_the_derivative_of_the_task_velocity(task, robot, rng):
    for _ in range(3):
        q, v = random_state(robot, rng)
        expected = numerical_drift(task, robot, q, v)
        drift = terms_at(task, robot, q, v).drift
        np.testing.assert_allclose(drift, expected, rtol=1e-6, atol=1e-7)


def test_terms_have_one_row_and_one_unit_for_each_task_row(task, robot, rng):
    terms = terms_at(task, robot, *random_state(robot, rng))
    assert len(task.units) == task.rows > 0
    assert set(task.units) <= {"m", "rad"}
    for part in (terms.drift, terms.acceleration, terms.error):
        assert part.shape == (task.rows,)
        assert part.dtype == np.float64


def test_command_brings_the_error_to_zero(task, robot, rng):
    """Integrate v̇ = J⁺ (f* − J̇ v) from a start to a value that was held elsewhere."""
    q, _ = random_state(robot, rng)
    still = np.zeros(robot.nv)
    terms_at(task, robot, robot.integrate(q, rng.uniform(-0.2, 0.2, robot.nv), 1.0), still)
    first, v, dt = terms_at(task, robot, q, still).error, still, 2e-3
    for _ in range(500):
        terms = terms_at(task, robot, q, v)
        v = v + dt * np.linalg.pinv(terms.J, rcond=1e-6) @ (terms.acceleration - terms.drift)
        q = robot.integrate(q, v, dt)
    last = terms_at(task, robot, q, v).error
    # Critical damping at 10 1/s leaves (1 + 10) exp(−10) = 5e-4 after one second; one axis of an
    # orientation obeys this only to first order, because the other axes turn too.
    assert np.linalg.norm(last) < 1e-2 * np.linalg.norm(first)


def test_evaluating_twice_gives_the_same(task, robot, rng):
    q, v = random_state(robot, rng)
    one, two = terms_at(task, robot, q, v), terms_at(task, robot, q, v)
    for name in ("J", "drift", "acceleration", "error"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_results_survive_the_next_update(task, robot, rng):
    q, v = random_state(robot, rng)
    terms = terms_at(task, robot, q, v)
    copies = {n: getattr(terms, n).copy() for n in ("J", "drift", "acceleration", "error")}
    terms_at(task, robot, *random_state(robot, rng))
    for name, copy in copies.items():
        np.testing.assert_array_equal(getattr(terms, name), copy)
