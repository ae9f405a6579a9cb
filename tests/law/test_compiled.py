"""The compiled law against the readable one, on random stacks."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opspace.kernels.algebra import cholesky, singular_values
from opspace.kernels.compiled_scalars import profile, ramp
from opspace.kernels.corners import sort_corners
from opspace.kernels.walk import begin, slot_bit, start_at, walk
from opspace.law import SigmaBuffer, TaskSet, blended_torque, corners
from opspace.law.activation import PROFILES, Profile, Ramp
from opspace.law.hierarchy import whiten
from opspace.machine.lanes import whole
from opspace.plan.memory import Sizes, make_inertia
from opspace.plan.records import SPACE
from tests.budget import examples


def random_stack(rng):
    """Task sets of all sizes, dependent rows, rows of zeros, more than the joints can do."""
    n = int(rng.integers(1, 9))
    A = rng.normal(size=(n, n))
    tasks = []
    for k in range(rng.integers(0, 5)):
        m = int(rng.integers(0, n + 2))
        J = rng.normal(size=(m, n))
        if m > 1 and rng.random() < 0.4:
            J[-1] = rng.choice([0.0, 1.0]) * J[0] + rng.choice([0.0, 1e-2, 0.3]) * J[-1]
        h = float(rng.choice([1.0, 1.0, 0.0, rng.random()]))
        reference = float(rng.choice([1.0, 2.5]))
        tasks.append(
            TaskSet(J, 10 * rng.normal(size=m), int(rng.integers(4)), h, str(k), reference)
        )
    return A @ A.T + 0.1 * np.eye(n), tasks


def compiled_torque(L, tasks, blend, buffer):
    n = L.shape[0]
    order = sorted(range(len(tasks)), key=lambda k: (tasks[k].priority, k))
    ranks = {p: k for k, p in enumerate(sorted({task.priority for task in tasks}))}
    whitened = whiten(tasks, L)
    slots, row = [], 0
    for k in order:
        slots.append((1 + ranks[tasks[k].priority], row, tasks[k].f.size))
        row += tasks[k].f.size
    masks = np.array(
        [sum(slot_bit(order.index(k)) for k in c.present) for c in blend], dtype=np.int64
    )
    weights = np.array([corner.weight for corner in blend])
    count = sort_corners(masks, weights, len(blend))
    size = Sizes(
        n=n, tasks=0, rows=row, slot_rows=row, slots=0, levels=len(ranks), variables=0, limits=0,
        corners=1,
    )  # fmt: skip
    space = SPACE.make(size.by_name(), {"inertia": make_inertia(np.arange(n) - 1)})
    s = space.handle()
    levels = len(ranks) + 1
    begin(levels, s)
    start_at(1, n, s)
    u = np.zeros(n)
    J = np.zeros((row, whole(n)))
    J[:, :n] = np.concatenate([np.zeros((0, n)), *(whitened[k].J for k in order)])
    walk(
        1, levels, n, np.array(slots, np.int64).reshape(-1, 3), J,
        np.concatenate([np.zeros(0), *(whitened[k].f for k in order)]),
        masks, weights, count, np.zeros(n + 1), buffer, s, u,
    )  # fmt: skip
    return L @ u


@examples(50)
@given(
    seed=st.integers(0, 2**32 - 1),
    smooth=st.booleans(),
    blending=st.sampled_from(["idv", "chain"]),
)
def test_the_compiled_law_is_the_law(seed, smooth, blending):
    M, tasks = random_stack(np.random.default_rng(seed))
    L = np.linalg.cholesky(M)
    blend = corners([task.activation for task in tasks], blending)
    option = SigmaBuffer(0.2, 1.0) if smooth else None
    buffer = np.array([float(smooth), 0.2, 1.0, PROFILES.index("quintic"), 1.0, 0.0, 0.1, 0.3, 0.4])
    expected, _ = blended_torque(L, tasks, blend, option)
    tau = compiled_torque(L, tasks, blend, buffer)
    scale = max(1.0, float(np.max(np.abs(expected))))
    np.testing.assert_allclose(tau, expected, rtol=0, atol=1e-9 * scale)


@given(st.sampled_from(PROFILES), st.floats(-0.5, 1.5))
def test_profiles(name, s):
    assert profile(PROFILES.index(name), s) == pytest.approx(Profile(name)(s).value, abs=4e-15)


@given(
    st.sampled_from(["quintic", "cubic", "tanh", "half-sine", "linear"]),
    st.lists(st.tuples(st.sampled_from([0.0, 1.0]), st.floats(0.0, 2.0), st.floats(0.0, 1.0))),
    st.floats(0.0, 5.0),
)
def test_ramps(name, turns, t):
    readable, now = Ramp.resting(0.0, name), 0.0
    for target, duration, wait in turns:
        readable = readable.towards(target, duration, now)
        now += wait
    value = ramp(t, PROFILES.index(name), *readable.numbers)
    assert value == pytest.approx(readable(t).value, abs=1e-12)


@given(st.integers(0, 2**32 - 1), st.integers(1, 8), st.integers(0, 6))
def test_singular_values(seed, k, extra):
    rng = np.random.default_rng(seed)
    m = k + extra
    A = rng.normal(size=(k, m)) * np.exp(rng.uniform(-12, 2, (k, 1)))
    if rng.random() < 0.3:
        A[-1] = A[0]
    C, Y, s = A.copy(), np.zeros((k, k)), np.zeros(k)
    singular_values(C, k, m, Y, s)
    expected = np.linalg.svd(A, compute_uv=False)
    np.testing.assert_allclose(s, expected, rtol=1e-12, atol=1e-14 * expected[0])
    np.testing.assert_allclose(Y @ Y.T, np.eye(k), atol=1e-13)
    np.testing.assert_allclose(Y @ A, C, atol=1e-13 * expected[0])


@given(st.integers(0, 2**32 - 1), st.integers(1, 8), st.floats(-1.0, 1.0))
def test_the_certificate_is_exact(seed, m, shift):
    B = np.random.default_rng(seed).normal(size=(m, m + 1))
    smallest = np.linalg.eigvalsh(B @ B.T)[0]
    bound = smallest * (1.0 + shift)
    if abs(shift) > 1e-6:
        assert cholesky(B @ B.T, m, bound, np.zeros((m, m))) == (bound < smallest)


@given(st.integers(0, 2**32 - 1), st.floats(-6.0, -0.3), st.integers(0, 3))
def test_just_above_a_small_buffer_the_last_level_keeps_its_digits(seed, decades, more):
    rng = np.random.default_rng(seed)
    n, upper = 5, 10.0**decades
    U, V = (np.linalg.qr(rng.normal(size=(k, k)))[0] for k in (n + more, n))
    J = U[:, :n] * [1.0, 1.0, 1.0, 1.0, math.sqrt(2.0 * upper)] @ V.T
    tasks = [TaskSet(J, rng.normal(size=n + more), 0, 1.0, "a", 1.0)]
    blend = corners([1.0], "idv")
    expected, _ = blended_torque(np.eye(n), tasks, blend, SigmaBuffer(upper / 5.0, upper))
    buffer = np.array(
        [1.0, upper / 5.0, upper, PROFILES.index("quintic"), upper, 0.0, upper, upper, upper]
    )
    found = compiled_torque(np.eye(n), tasks, blend, buffer)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.linalg.norm(expected))
