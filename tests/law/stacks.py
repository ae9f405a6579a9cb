"""Random stacks for the property tests: any size, any order, ordinary and degenerate."""

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from opspace.law import TaskSet


@dataclass(frozen=True)
class Stack:
    M: np.ndarray
    tasks: list[TaskSet]

    @property
    def n(self) -> int:
        return self.M.shape[0]

    def with_activations(self, activations) -> list[TaskSet]:
        return [t.replace(activation=h) for t, h in zip(self.tasks, activations, strict=True)]


def inertia(rng: np.random.Generator, n: int) -> np.ndarray:
    """Random inertia with eigenvalues between 0.1 and 10 kg·m², as on an arm."""
    Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
    return Q @ np.diag(10.0 ** rng.uniform(-1, 1, n)) @ Q.T


DEGENERACIES = ("none", "repeated", "zero row", "rank one", "no rows", "shared row")


def jacobian(rng: np.random.Generator, kind: str, n: int, others: list[np.ndarray]) -> np.ndarray:
    J = rng.normal(size=(int(rng.integers(1, 5)), n))
    if kind == "repeated" and others:
        return others[int(rng.integers(len(others)))].copy()
    if kind == "zero row":
        J[0] = 0.0
    if kind == "rank one":
        J = np.outer(rng.normal(size=J.shape[0]), J[0])
    if kind == "no rows":
        J = np.zeros((0, n))
    if kind == "shared row" and others and others[0].shape[0]:
        J[-1] = others[0][0]
    return J


@st.composite
def stacks(draw, max_tasks: int = 6, max_levels: int = 4, activations=None) -> Stack:
    """n = 2 … 14, up to six task sets on mixed levels; many ask for more than n motions."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(2, 14))
    kinds = draw(st.lists(st.sampled_from(DEGENERACIES), min_size=1, max_size=max_tasks))
    values = st.one_of(st.sampled_from([0.0, 1.0]), st.floats(0.0, 1.0))
    if activations is not None:
        values = activations
    jacobians: list[np.ndarray] = []
    tasks = []
    for kind in kinds:
        J = jacobian(rng, kind, n, jacobians)
        jacobians.append(J)
        f = rng.normal(size=J.shape[0])
        tasks.append(TaskSet(J, f, draw(st.integers(0, max_levels - 1)), draw(values)))
    return Stack(inertia(rng, n), tasks)


def scale_of(*torques) -> float:
    """Largest torque in sight: what a relative error is relative to."""
    return max(1.0, *(float(np.max(np.abs(tau), initial=0.0)) for tau in torques))
