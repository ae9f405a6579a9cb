"""A quadratic-program controller with hard switching becomes continuous through intermediate values."""

import daqp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.law import TaskSet, intermediate_values, task_torque
from tests.budget import examples
from tests.law.stacks import inertia

N = 7


def hierarchical_qp(M, limit):
    """Somebody's whole-body controller: level by level, a QP in (Γ, slack) with torque limits.

    min ½‖slack‖² + ½ ε Γᵀ A⁻¹ Γ   s.t.  J A⁻¹ Γ + slack = f,  levels above kept,  |Γ| <= limit
    """
    Mi = np.linalg.inv(M)

    def solve(tasks: list[TaskSet]) -> np.ndarray:
        kept_A, kept_b = np.zeros((0, N)), np.zeros(0)
        tau = np.zeros(N)
        for priority in sorted({t.priority for t in tasks}):
            level = [t for t in tasks if t.priority == priority]
            J = np.concatenate([t.J for t in level]) @ Mi
            f = np.concatenate([t.f for t in level])
            tau = qp(J.T @ J + 1e-7 * Mi, -J.T @ f, kept_A, kept_b, limit)
            kept_A, kept_b = np.concatenate([kept_A, J]), np.concatenate([kept_b, J @ tau])
        return tau

    return solve


def qp(H, g, A, b, limit):
    rows = np.ascontiguousarray(A)
    upper = np.concatenate([np.full(N, limit), b + 1e-9])
    lower = np.concatenate([np.full(N, -limit), b - 1e-9])
    x, _, flag, _ = daqp.solve(
        np.ascontiguousarray(H), g, rows, upper, lower, np.zeros(upper.size, dtype=np.int32)
    )
    assert flag > 0, flag
    return x


def path(M, tasks, solve, activations):
    """Torque of the unchanged controller fed with intermediate values, along a change of h."""
    result = []
    for h in activations:
        stack = [tasks[0].replace(activation=h), *tasks[1:]]
        values = intermediate_values(solve, stack, M)
        fed = [t.replace(f=f, activation=1.0) for t, f in zip(stack, values, strict=True)]
        result.append(solve(fed))
    return np.array(result)


def weighted_qp(M, limit):
    """Somebody else's: one QP with soft weights instead of strict priorities, and torque limits."""
    Mi = np.linalg.inv(M)

    def solve(tasks: list[TaskSet]) -> np.ndarray:
        H, g = 1e-2 * Mi, np.zeros(N)
        for t in tasks:
            J = t.J @ Mi
            H, g = H + J.T @ J, g - J.T @ t.f
        return qp(H, g, np.zeros((0, N)), np.zeros(0), limit)

    return solve


CONTROLLERS = {
    "strict priorities": lambda M: hierarchical_qp(M, 1e3),
    "weights": lambda M: weighted_qp(M, 1e3),
    "weights, torque limits reached": lambda M: weighted_qp(M, 0.2),
}


@examples(30)
@given(st.integers(0, 2**32 - 1), st.sampled_from(sorted(CONTROLLERS)))
def test_a_hard_switched_qp_becomes_continuous(seed, kind):
    rng = np.random.default_rng(seed)
    M = inertia(rng, N)
    tasks = [
        TaskSet(rng.normal(size=(3, N)), rng.normal(size=3), 0, name="inserted on top"),
        TaskSet(rng.normal(size=(2, N)), rng.normal(size=2), 1),
        TaskSet(rng.normal(size=(1, N)), rng.normal(size=1), 2),
    ]
    solve = CONTROLLERS[kind](M)
    without, switched_on = solve(tasks[1:]), solve(tasks)
    switch = np.max(np.abs(switched_on - without))
    faded = path(M, tasks, solve, np.linspace(0.0, 1.0, 6))
    tolerance = 1e-4 * max(1.0, switch)
    np.testing.assert_allclose(faded[0], without, atol=tolerance)
    np.testing.assert_allclose(faded[-1], switched_on, atol=tolerance)
    steps = np.max(np.abs(np.diff(faded, axis=0)), axis=1)
    # A jump would stay as large as it is however closely one looks; a slope, however steep, does not.
    start, width = 0.0, 0.2
    first = np.max(steps)
    for look in range(6):
        if look >= 2 and np.max(steps) < 0.4 * first:
            break
        start, width = start + width * int(np.argmax(steps)), width / 8
        near = path(M, tasks, solve, start + width * np.arange(9))
        steps = np.max(np.abs(np.diff(near, axis=0)), axis=1)
    assert np.max(steps) < 0.4 * first + tolerance


def test_the_torque_limits_of_the_weighted_qp_are_reached():
    rng = np.random.default_rng(0)
    M = inertia(rng, N)
    tasks = [TaskSet(rng.normal(size=(3, N)), rng.normal(size=3), 0)]
    assert np.max(np.abs(weighted_qp(M, 0.2)(tasks))) == pytest.approx(0.2)


def test_without_reached_limits_the_qp_is_the_law():
    """What makes the test above mean something: the QP is no toy of our own law."""
    rng = np.random.default_rng(11)
    M = inertia(rng, N)
    tasks = [TaskSet(rng.normal(size=(2, N)), rng.normal(size=2), p) for p in range(3)]
    np.testing.assert_allclose(
        hierarchical_qp(M, 1e3)(tasks), task_torque(M, tasks), rtol=0, atol=1e-3
    )
