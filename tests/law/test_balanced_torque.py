"""A force is a consistent wish: torque that is balanced by a reaction, beside the rows."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from opspace.law import TaskSet, corners, task_torque
from tests.law.stacks import Stack, scale_of, stacks

FULL = st.just(1.0)


def wished(stack: Stack, tau: np.ndarray, tasks: list[TaskSet] | None = None) -> list[TaskSet]:
    """The stack, each task of which also wishes for the acceleration that a torque gives it."""
    more = np.linalg.solve(stack.M, tau)
    return [task.replace(f=task.f + task.J @ more) for task in tasks or stack.tasks]


def pressed(seed: int, task: TaskSet) -> np.ndarray:
    """Torque Jᵀ F of a random force along the rows of a task."""
    return task.J.T @ np.random.default_rng(seed).normal(size=task.J.shape[0])


@given(stacks(activations=FULL), st.integers(0, 2**32 - 1), st.integers(0, 5))
def test_a_force_along_rows_of_the_stack_is_the_wish_for_what_it_would_do(stack, seed, which):
    """Lemma F: at whatever level the rows are, and however the levels contradict each other."""
    g = pressed(seed, stack.tasks[which % len(stack.tasks)])
    asked = task_torque(stack.M, wished(stack, g))
    given_beside = g + task_torque(stack.M, stack.tasks)
    np.testing.assert_allclose(asked, given_beside, atol=1e-10 * scale_of(asked, g), rtol=0)


@given(stacks(max_tasks=4), st.integers(0, 2**32 - 1), st.sampled_from(["idv", "chain"]))
def test_stacks_that_carry_torques_blend_to_the_sum_of_activation_times_torque(stack, seed, way):
    """Proposition 3': the stack S fed with intermediate values of worlds with their own wishes."""
    tasks, M = stack.tasks, stack.M
    h = [task.activation for task in tasks]
    g = [pressed(seed + k, task) for k, task in enumerate(tasks)]
    full = [task.replace(activation=1.0) for task in tasks]
    blended = sum(a * b for a, b in zip(h, g, strict=True))
    values = [np.zeros_like(task.f) for task in tasks]
    for w, here in corners(h, way):
        u = task_torque(M, [full[k] for k in sorted(here)])
        blended = blended + w * u
        carried = sum((g[k] for k in here), np.zeros(stack.n))
        for k, task in enumerate(tasks):
            if k in here:
                wish = task.f + task.J @ np.linalg.solve(M, carried)
            else:
                wish = task.J @ np.linalg.solve(M, u + carried)
            values[k] = values[k] + w * wish
    fed = task_torque(M, [t.replace(f=f) for t, f in zip(full, values, strict=True)])
    np.testing.assert_allclose(fed, blended, atol=1e-10 * scale_of(fed, blended, *g), rtol=0)
