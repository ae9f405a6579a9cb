"""Laws of the transition: recursion = blend, corners, continuity, cost."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from opspace.law import TaskSet, intermediate_values, task_torque
from opspace.law.hierarchy import hard_law, levels_of, whiten
from opspace.law.recursion import law_recursion
from tests.budget import examples
from tests.law.stacks import inertia, scale_of, stacks

MANY = examples(60)


def hard_torques(M, tasks):
    """Every hard torque of a stack by brute force over subsets, and the worst conditioned level."""
    L = np.linalg.cholesky(M)
    whitened, levels = whiten(tasks, L), levels_of(tasks)
    everything = range(len(tasks))
    return {
        T: L @ hard_law(whitened, levels, frozenset(T), M.shape[0])
        for size in range(len(tasks) + 1)
        for T in combinations(everything, size)
    }


def well_conditioned(torques) -> bool:
    """Random square levels are sometimes nearly singular; rounding then drowns what is tested."""
    return scale_of(*torques.values()) < 1e5


@MANY
@given(stacks())
def test_the_recursion_equals_the_subset_blend(stack):
    corners = hard_torques(stack.M, stack.tasks)
    assume(well_conditioned(corners))
    L = np.linalg.cholesky(stack.M)
    recursion = law_recursion(
        whiten(stack.tasks, L), levels_of(stack.tasks), [t.activation for t in stack.tasks], stack.n
    )
    by_recursion = L @ recursion.command(frozenset(range(len(stack.tasks))))
    by_blend = task_torque(stack.M, stack.tasks, "idv")
    np.testing.assert_allclose(
        by_recursion, by_blend, rtol=0, atol=1e-8 * scale_of(*corners.values())
    )


@MANY
@given(stacks())
def test_the_subset_blend_is_the_multilinear_interpolation_of_hard_torques(stack):
    corners = hard_torques(stack.M, stack.tasks)
    h = [t.activation for t in stack.tasks]
    expected = sum(
        np.prod([h[k] if k in T else 1 - h[k] for k in range(len(h))]) * tau
        for T, tau in corners.items()
    )
    got = task_torque(stack.M, stack.tasks)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-10 * scale_of(*corners.values()))


@MANY
@given(stacks(), st.data(), st.sampled_from(["idv", "chain"]))
def test_activation_one_is_with_and_zero_is_without_the_task(stack, data, blending):
    k = data.draw(st.integers(0, len(stack.tasks) - 1))
    others = [t for i, t in enumerate(stack.tasks) if i != k]
    off = [*others, stack.tasks[k].replace(activation=0.0)]
    assert np.array_equal(
        task_torque(stack.M, off, blending), task_torque(stack.M, others, blending)
    )
    on = [t.replace(activation=1.0) if i == k else t for i, t in enumerate(stack.tasks)]
    nearly = [t.replace(activation=1 - 1e-9) if i == k else t for i, t in enumerate(stack.tasks)]
    corners = hard_torques(stack.M, stack.tasks)
    np.testing.assert_allclose(
        task_torque(stack.M, on, blending),
        task_torque(stack.M, nearly, blending),
        rtol=0,
        atol=1e-7 * scale_of(*corners.values()),
    )


@MANY
@given(stacks(), st.sampled_from(["idv", "chain"]))
def test_feeding_intermediate_values_to_the_unchanged_law_gives_the_blend(stack, blending):
    corners = hard_torques(stack.M, stack.tasks)
    assume(well_conditioned(corners))
    values = intermediate_values(stack.M, stack.tasks, blending=blending)
    fed = [t.replace(f=f, activation=1.0) for t, f in zip(stack.tasks, values, strict=True)]
    np.testing.assert_allclose(
        task_torque(stack.M, fed),
        task_torque(stack.M, stack.tasks, blending),
        rtol=0,
        atol=1e-8 * scale_of(*corners.values()),
    )


@MANY
@given(stacks(), st.sampled_from(["idv", "chain"]))
def test_the_adapter_around_the_law_gives_the_laws_own_values(stack, blending):
    corners = hard_torques(stack.M, stack.tasks)
    assume(well_conditioned(corners))
    own = intermediate_values(stack.M, stack.tasks, blending=blending)
    adapted = intermediate_values(
        lambda tasks: task_torque(stack.M, tasks), stack.tasks, stack.M, blending=blending
    )
    scale = scale_of(*corners.values()) / 0.1  # the smallest inertia eigenvalue
    for a, b in zip(own, adapted, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-8 * scale)


@examples(30)
@given(stacks(), st.sampled_from(["idv", "chain"]), st.data())
def test_torque_is_continuous_along_paths_of_all_activations(stack, blending, data):
    """No step is larger than the activations' own steps times the widest gap of hard torques.

    The slope in one activation is a mixture of differences of hard torques with and without the task,
    so the bound holds for any path, and shrinks with it: ten times finer, ten times smaller steps.
    """
    edge = st.one_of(st.sampled_from([0.0, 1.0]), st.floats(0.0, 1.0))
    ends = data.draw(st.lists(edge, min_size=len(stack.tasks), max_size=len(stack.tasks)))
    begin = np.array([t.activation for t in stack.tasks])
    corners = np.array(list(hard_torques(stack.M, stack.tasks).values()))
    widest = np.max(corners.max(axis=0) - corners.min(axis=0))

    def steps(a, b, intervals):
        path = [
            task_torque(
                stack.M, stack.with_activations((1 - s) * begin + s * np.array(ends)), blending
            )
            for s in np.linspace(a, b, intervals + 1)
        ]
        return np.max(np.abs(np.diff(path, axis=0)), axis=1)

    length = np.sum(np.abs(begin - ends))
    rounding = 1e-9 * scale_of(corners)
    coarse = steps(0.0, 1.0, 5)
    assert np.max(coarse) <= length / 5 * widest + rounding
    worst = int(np.argmax(coarse))
    fine = steps(worst / 5, (worst + 1) / 5, 10)
    assert np.max(fine) <= length / 50 * widest + rounding


@MANY
@given(stacks(max_tasks=6, activations=st.sampled_from([0.0, 1.0])), st.data())
def test_chain_equals_idv_for_one_moving_task(stack, data):
    k = data.draw(st.integers(0, len(stack.tasks) - 1))
    h = data.draw(st.floats(0.0, 1.0))
    tasks = [t.replace(activation=h) if i == k else t for i, t in enumerate(stack.tasks)]
    np.testing.assert_allclose(
        task_torque(stack.M, tasks, "chain"),
        task_torque(stack.M, tasks, "idv"),
        rtol=1e-12,
        atol=1e-12 * scale_of(*hard_torques(stack.M, stack.tasks).values()),
    )


@MANY
@given(stacks(), st.sampled_from(["idv", "chain"]))
def test_the_torque_stays_in_the_hull_of_the_hard_torques(stack, blending):
    corners = np.array(list(hard_torques(stack.M, stack.tasks).values()))
    tau = task_torque(stack.M, stack.tasks, blending)
    slack = 1e-9 * scale_of(corners)
    assert np.all(tau <= corners.max(axis=0) + slack)
    assert np.all(tau >= corners.min(axis=0) - slack)


@pytest.mark.parametrize("k", range(9))
def test_hard_solves_are_counted(k):
    rng = np.random.default_rng(k)
    M = inertia(rng, 12)
    h = rng.permutation(np.linspace(0.1, 0.9, 8))
    tasks = [
        TaskSet(rng.normal(size=(2, 12)), rng.normal(size=2), i // 2, h[i] if i < k else 1.0)
        for i in range(8)
    ]
    tasks.append(TaskSet(rng.normal(size=(2, 12)), rng.normal(size=2), 3, 0.0))
    _, idv = task_torque(M, tasks, "idv", info=True)
    _, chain = task_torque(M, tasks, "chain", info=True)
    assert idv.hard_solves == 2**k
    assert chain.hard_solves == k + 1
    assert idv.level_solves <= 4 * 2**k
    assert chain.level_solves <= 4 * (k + 1)


def test_levels_above_the_first_branching_one_are_solved_once():
    rng = np.random.default_rng(5)
    tasks = [TaskSet(rng.normal(size=(2, 9)), rng.normal(size=2), p) for p in range(3)]
    tasks += [TaskSet(rng.normal(size=(1, 9)), rng.normal(size=1), 3, h) for h in (0.2, 0.6)]
    _, info = task_torque(inertia(rng, 9), tasks, info=True)
    assert info.level_solves == 3 + 3  # the corner without either has no fourth level


@MANY
@given(stacks())
def test_priorities_hold_at_the_corners(stack):
    """J N = 0: nothing a lower level does is felt by the levels above it."""
    hard = stack.with_activations([1.0] * len(stack.tasks))
    first = min(t.priority for t in hard)
    top = [t for t in hard if t.priority == first]
    J = np.concatenate([t.J for t in top])
    corners = hard_torques(stack.M, hard)
    assume(well_conditioned(corners))
    achieved = J @ np.linalg.solve(stack.M, task_torque(stack.M, hard))
    alone = J @ np.linalg.solve(stack.M, task_torque(stack.M, top))
    np.testing.assert_allclose(
        achieved, alone, rtol=0, atol=1e-9 * scale_of(*corners.values()) / 0.1
    )


@MANY
@given(stacks(), st.integers(0, 2**32 - 1))
def test_the_order_of_the_list_does_not_matter(stack, seed):
    order = np.random.default_rng(seed).permutation(len(stack.tasks))
    corners = hard_torques(stack.M, stack.tasks)
    assume(well_conditioned(corners))
    np.testing.assert_allclose(
        task_torque(stack.M, [stack.tasks[i] for i in order]),
        task_torque(stack.M, stack.tasks),
        rtol=0,
        atol=1e-9 * scale_of(*corners.values()),
    )


def test_an_empty_stack_gives_no_torque():
    assert np.array_equal(task_torque(np.eye(3), []), np.zeros(3))
    assert intermediate_values(np.eye(3), []) == []
