"""The law against the paper's equations, written out with plain inverses."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from opspace.law import TaskSet, task_torque
from tests.budget import examples
from tests.law.stacks import inertia

MANY = examples(60)
SEEDS = st.integers(0, 2**32 - 1)
H = st.floats(0.0, 1.0)
RTOL = 1e-8


class Printed:
    """A regular stack of task sets and the paper's symbols for it."""

    def __init__(self, seed: int, rows: list[int], extra: int) -> None:
        rng = np.random.default_rng(seed)
        self.n = sum(rows) + extra
        self.A = inertia(rng, self.n)
        self.Ai = np.linalg.inv(self.A)
        # Rows with singular values in [0.5, 2] keep every Λ of these formulas invertible.
        Q, _ = np.linalg.qr(rng.normal(size=(self.n, self.n)))
        mix = np.eye(self.n) + 0.3 * rng.uniform(-1, 1, (self.n, self.n)) / self.n
        stacked = np.diag(rng.uniform(0.5, 2.0, self.n)) @ mix @ Q
        edges = np.cumsum([0, *rows])
        self.J = [stacked[a:b] for a, b in itertools.pairwise(edges)]
        self.f = [rng.normal(size=m) for m in rows]

    def Lambda(self, J):
        return np.linalg.inv(J @ self.Ai @ J.T)

    def NT(self, J):
        """Nᵀ = I − Jᵀ J̄ᵀ with J̄ = A⁻¹ Jᵀ Λ (Eq. 16, misprint corrected)."""
        return np.eye(self.n) - J.T @ (self.Ai @ J.T @ self.Lambda(J)).T

    def unprioritized(self, f, members):
        J = np.concatenate([self.J[k] for k in members])
        return J.T @ self.Lambda(J) @ np.concatenate([f[k] for k in members])

    def prioritized(self, f, members):
        """Γ = Σ (J_k N)ᵀ Λ_{k|…} (f_k − J_k A⁻¹ Γ_above) for members in order of priority."""
        tau, NT = np.zeros(self.n), np.eye(self.n)
        for k in members:
            JN = self.J[k] @ NT.T
            Lambda = self.Lambda(JN)
            tau = tau + JN.T @ Lambda @ (f[k] - self.J[k] @ self.Ai @ tau)
            NT = NT @ (np.eye(self.n) - JN.T @ (self.Ai @ JN.T @ Lambda).T)
        return tau

    def literal(self, law, h, members):
        """Eq. 13 and 23: f_m^i = h_m f_m + (1 − h_m) J_m A⁻¹ Γ*_m, to the letter."""
        if not members:
            return np.zeros(self.n)
        f = dict(enumerate(self.f))
        for m in members:
            rest = [k for k in members if k != m]
            star = self.literal(law, h, rest)
            f[m] = h[m] * self.f[m] + (1 - h[m]) * self.J[m] @ self.Ai @ star
        return law(f, members)

    def torque(self, h, priorities, **options):
        tasks = [
            TaskSet(J, f, p, a) for J, f, p, a in zip(self.J, self.f, priorities, h, strict=True)
        ]
        return task_torque(self.A, tasks, **options)


def close(a, b):
    np.testing.assert_allclose(a, b, rtol=RTOL, atol=RTOL * max(1.0, float(np.max(np.abs(b)))))


@MANY
@given(SEEDS, st.integers(1, 3), st.integers(1, 3), st.integers(0, 3), H, H)
def test_two_task_sets_without_priority_are_eq_10_and_12(seed, m1, m2, extra, h1, h2):
    p = Printed(seed, [m1, m2], extra)
    (J1, J2), (f1, f2) = p.J, p.f
    star1 = J2.T @ (h2 * p.Lambda(J2) @ f2)
    star2 = J1.T @ (h1 * p.Lambda(J1) @ f1)
    f = [h1 * f1 + (1 - h1) * J1 @ p.Ai @ star1, h2 * f2 + (1 - h2) * J2 @ p.Ai @ star2]
    close(p.torque([h1, h2], [0, 0]), p.unprioritized(f, [0, 1]))


@MANY
@given(SEEDS, st.integers(0, 3), H, H, H)
def test_three_task_sets_without_priority_are_eq_13(seed, extra, h1, h2, h3):
    p = Printed(seed, [2, 1, 2], extra)
    h = [h1, h2, h3]
    close(p.torque(h, [4, 4, 4]), p.literal(p.unprioritized, h, [0, 1, 2]))


@MANY
@given(SEEDS, st.integers(1, 3), st.integers(1, 3), st.integers(0, 3), H, H)
def test_two_prioritized_task_sets_are_eq_17_to_20_with_compensation(seed, m1, m2, extra, h1, h2):
    p = Printed(seed, [m1, m2], extra)
    (J1, J2), (f1, f2) = p.J, p.f
    f1i = h1 * f1 + (1 - h1) * J1 @ p.Ai @ J2.T @ (h2 * p.Lambda(J2) @ f2)
    f2i = h2 * f2 + (1 - h2) * J2 @ p.Ai @ J1.T @ (h1 * p.Lambda(J1) @ f1)
    first = J1.T @ p.Lambda(J1) @ f1i
    J21 = J2 @ p.NT(J1).T
    expected = first + J21.T @ p.Lambda(J21) @ (f2i - J2 @ p.Ai @ first)
    close(p.torque([h1, h2], [0, 1]), expected)


@MANY
@given(SEEDS, st.integers(0, 3), H, H, H)
def test_three_prioritized_task_sets_are_eq_21_to_23_with_compensation(seed, extra, h1, h2, h3):
    p = Printed(seed, [2, 2, 1], extra)
    h = [h1, h2, h3]
    close(p.torque(h, [0, 1, 2]), p.literal(p.prioritized, h, [0, 1, 2]))


@MANY
@given(SEEDS, st.integers(0, 3), H, H)
def test_as_printed_is_eq_19_and_20_to_the_letter(seed, extra, h1, h2):
    p = Printed(seed, [2, 2], extra)
    (J1, J2), (f1, f2) = p.J, p.f
    f1i = h1 * f1 + (1 - h1) * J1 @ p.Ai @ J2.T @ (h2 * p.Lambda(J2) @ f2)
    f2i = h2 * f2 + (1 - h2) * J2 @ p.Ai @ J1.T @ (h1 * p.Lambda(J1) @ f1)
    J21 = J2 @ p.NT(J1).T
    expected = J1.T @ p.Lambda(J1) @ f1i + J21.T @ p.Lambda(J21) @ f2i
    close(p.torque([h1, h2], [0, 1], coupling="as-printed"), expected)


def jump_at_zero(coupling: str, seed: int) -> float:
    """‖Γ(h1 = 0) − Γ of Eq. 14‖ / ‖Γ of Eq. 14‖, 3 + 3 rows on 7 joints."""
    rng = np.random.default_rng(seed)
    A = inertia(rng, 7)
    J1, J2 = rng.normal(size=(2, 3, 7))
    f1, f2 = rng.normal(size=(2, 3))
    alone = task_torque(A, [TaskSet(J2, f2, 1)])
    tiny = 0.0 if coupling == "as-printed" else 1e-13  # the library leaves h = 0 out altogether
    both = task_torque(A, [TaskSet(J1, f1, 0, tiny), TaskSet(J2, f2, 1)], coupling=coupling)
    return float(np.linalg.norm(both - alone) / np.linalg.norm(alone))


def test_as_printed_jumps_where_the_compensated_law_does_not():
    printed = [jump_at_zero("as-printed", seed) for seed in range(400)]
    compensated = [jump_at_zero("compensated", seed) for seed in range(400)]
    assert np.median(printed) > 0.5
    assert max(compensated) < 1e-9


@MANY
@given(
    seed=SEEDS, above=st.integers(0, 2), rows=st.integers(1, 3), more=st.integers(1, 3),
    near=st.sampled_from([0.0, 1e-13, 1e-11]),
)  # fmt: skip
def test_rows_that_depend_on_each_other_ask_for_what_their_independent_ones_do(
    seed, above, rows, more, near
):
    """To within rounding, too: what tells such rows apart is no direction of its own."""
    rng = np.random.default_rng(seed)
    printed = Printed(seed, [rows], 3)
    A, J, f = printed.A, printed.J[0], printed.f[0]
    mix = np.concatenate([np.eye(rows), rng.normal(size=(more, rows))])
    first = TaskSet(rng.normal(size=(above, printed.n)), rng.normal(size=above), 0)
    mixed = mix @ J + near * rng.normal(size=(rows + more, printed.n))
    last = TaskSet(np.eye(printed.n), np.ones(printed.n), 2)
    alone, together = (
        task_torque(A, [first, TaskSet(one, wish, 1), last])
        for one, wish in ((J, f), (mixed, mix @ f))
    )
    np.testing.assert_allclose(together, alone, rtol=1e-6, atol=1e-6 * np.abs(alone).max())
