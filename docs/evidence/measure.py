"""Measure what docs/theory.md claims: ``python docs/evidence/measure.py`` prints its tables.

The formulas of the paper are written out here with plain inverses, independently of the library.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import curves
import numpy as np

from opspace.law import SigmaBuffer, TaskSet, intermediate_values, task_torque
from opspace.law.hierarchy import Level, WhitenedTask, hard_law, levels_of, whiten
from opspace.law.recursion import Recursion

STACKS = 1000
"""Random stacks of 3 + 3 rows on 7 joints."""
DEGENERATE_STACKS = 300
"""Random stacks of up to five task sets with every kind of degeneracy."""
ROUNDING = 1e-10
"""Relative differences below this are rounding; their digits depend on the machine."""


def random_inertia(rng: np.random.Generator, n: int) -> np.ndarray:
    """Return an inertia with eigenvalues between 0.1 and 10 kg·m²."""
    Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
    return Q @ np.diag(10.0 ** rng.uniform(-1.0, 1.0, n)) @ Q.T


class Pair:
    """Two random task sets of three rows on seven joints, and the paper's symbols for them."""

    def __init__(self, seed: int) -> None:
        """Draw the stack number ``seed``."""
        rng = np.random.default_rng(seed)
        self.A = random_inertia(rng, 7)
        self.Ai = np.linalg.inv(self.A)
        self.J1, self.J2 = rng.normal(size=(2, 3, 7))
        self.f1, self.f2 = rng.normal(size=(2, 3))
        self.L1, self.L2 = self.Lambda(self.J1), self.Lambda(self.J2)
        self.N1T = np.eye(7) - self.J1.T @ (self.Ai @ self.J1.T @ self.L1).T
        self.first = self.J1.T @ self.L1 @ self.f1
        self.second = self.J2.T @ self.L2 @ self.f2

    def Lambda(self, J: np.ndarray) -> np.ndarray:
        """Return (J A⁻¹ Jᵀ)⁻¹."""
        return np.linalg.inv(J @ self.Ai @ J.T)

    def eq_19_20(self, h1: float, h2: float, *, compensate: bool) -> np.ndarray:
        """Return the torque of Eq. 19-20, with or without the compensation term."""
        f1 = h1 * self.f1 + (1 - h1) * self.J1 @ self.Ai @ (h2 * self.second)
        f2 = h2 * self.f2 + (1 - h2) * self.J2 @ self.Ai @ (h1 * self.first)
        upper = self.J1.T @ self.L1 @ f1
        if compensate:
            f2 = f2 - self.J2 @ self.Ai @ upper
        J21 = self.J2 @ self.N1T.T
        return upper + J21.T @ self.Lambda(J21) @ f2


def relative(a: np.ndarray, b: np.ndarray) -> float:
    """Return ‖a − b‖ / ‖b‖."""
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


def printed_equations() -> dict[str, tuple[str, str]]:
    """Return, per claim, the median as printed and the largest value as corrected."""
    found: dict[str, list[tuple[float, float]]] = {}
    for seed in range(STACKS):
        p = Pair(seed)
        both = [p.eq_19_20(1, 1, compensate=c) for c in (False, True)]
        rows = {
            "jump at h1 = 0": [relative(p.eq_19_20(0, 1, compensate=c), p.second) for c in (0, 1)],
            "jump at h2 = 0": [relative(p.eq_19_20(1, 0, compensate=c), p.first) for c in (0, 1)],
            "lower task missed": [relative(p.J2 @ p.Ai @ tau, p.f2) for tau in both],
            "unprioritized task missed": stacked_force(p),
            "projected spectrum": projected_spectrum(p),
        }
        for claim, (printed, corrected) in rows.items():
            found.setdefault(claim, []).append((printed, corrected))
    return {
        claim: (percent(np.median(values, axis=0)[0]), bound(np.max(values, axis=0)[1], 1e-6))
        for claim, values in found.items()
    }


def stacked_force(p: Pair) -> list[float]:
    """Return how far Eq. 6-7 miss f₁ with F_k = Λ_k f_k, and with the Λ of the stacked J."""
    J, f = np.concatenate([p.J1, p.J2]), np.concatenate([p.f1, p.f2])
    torques = p.first + p.second, J.T @ p.Lambda(J) @ f
    return [relative(p.J1 @ p.Ai @ tau, p.f1) for tau in torques]


def projected_spectrum(p: Pair) -> list[float]:
    """Return how far Eq. 25 as printed is from its correction, and that from symmetry."""
    correct = p.J2 @ p.Ai @ p.N1T @ p.J2.T
    return [relative(p.J2 @ p.Ai @ p.N1T @ p.J1.T, correct), relative(correct.T, correct)]


def split_at_the_edge() -> dict[str, str]:
    """Return the median relative step of three ways to treat a weak direction, per way."""
    steps = []
    for seed in range(STACKS):
        p = Pair(seed)
        full = p.first
        U_of_J = np.linalg.svd(p.J1)[0]
        U = np.linalg.eigh(p.J1 @ p.Ai @ p.J1.T)[1][:, ::-1]
        by_J = sum_of_parts(p, U_of_J[:, :2]) + sum_of_parts(p, U_of_J[:, 2:])
        by_sigma = sum_of_parts(p, U[:, :2]) + sum_of_parts(p, U[:, 2:])
        kept = sum_of_parts(p, U[:, :2])
        steps.append([relative(torque, full) for torque in (by_J, by_sigma, kept)])
    by_J, by_sigma, cut = np.median(steps, axis=0)
    return {
        "weak direction cut at a threshold": percent(cut),
        "parts along the singular vectors of J": percent(by_J),
        "parts along the eigenvectors of Λ⁻¹": percent(by_sigma),
    }


def sum_of_parts(p: Pair, U: np.ndarray) -> np.ndarray:
    """Return the torque of the rows Uᵀ J₁ alone, divided by their own inertia."""
    J = U.T @ p.J1
    return J.T @ p.Lambda(J) @ (U.T @ p.f1)


def degenerate_stack(seed: int) -> tuple[np.ndarray, list[TaskSet]]:
    """Return an inertia and up to five task sets: repeated, zero, dependent, too many rows."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    jacobians: list[np.ndarray] = []
    for _ in range(int(rng.integers(1, 6))):
        J = rng.normal(size=(int(rng.integers(1, 5)), n))
        kind = rng.integers(6)
        if kind == 0 and jacobians:
            J = jacobians[int(rng.integers(len(jacobians)))].copy()
        if kind == 1:
            J[0] = 0.0
        if kind == 2:
            J = np.outer(rng.normal(size=J.shape[0]), J[0])
        if kind == 3:
            J = np.zeros((0, n))
        jacobians.append(J)
    tasks = [
        TaskSet(
            J,
            rng.normal(size=J.shape[0]),
            priority=int(rng.integers(3)),
            activation=float(rng.choice([0.0, 1.0, *rng.uniform(size=4)])),
            sigma_reference=10.0 ** rng.uniform(-1, 1, J.shape[0]),
        )
        for J in jacobians
    ]
    return random_inertia(rng, n), tasks


def theorem() -> dict[str, str]:
    """Return the largest relative violation of each statement over the degenerate stacks."""
    largest = np.zeros(4)
    for seed in range(DEGENERATE_STACKS):
        M, tasks = degenerate_stack(seed)
        largest = np.maximum(largest, violations(M, tasks, np.random.default_rng(seed)))
    claims = (
        "recursion against multilinear blend",
        "recursion that keeps h = 0 against one that drops it",
        "values of arbitrary signed weights, fed to the law, against their blend",
        "values of the chain, fed to the law, against the chain",
    )
    return {claim: bound(value) for claim, value in zip(claims, largest, strict=True)}


def violations(M: np.ndarray, tasks: list[TaskSet], rng: np.random.Generator) -> list[float]:
    """Return the relative violations of the four statements for one stack."""
    n, h = M.shape[0], [task.activation for task in tasks]
    whitened, levels = whiten(tasks, np.linalg.cholesky(M)), levels_of(tasks)
    members = range(len(tasks))
    subsets = [frozenset(T) for size in range(len(tasks) + 1) for T in combinations(members, size)]
    hard = {T: hard_law(whitened, levels, T, n) for T in subsets}
    scale = max(1.0, *(float(np.linalg.norm(u)) for u in hard.values()))
    blend = sum(np.prod([h[k] if k in T else 1 - h[k] for k in members]) * hard[T] for T in subsets)
    everything = frozenset(members)
    dropping, keeping = (recursion(whitened, levels, h, n, drop) for drop in (True, False))
    w = dict(zip(subsets, rng.normal(size=len(subsets)), strict=True))
    fed = [
        WhitenedTask(
            task.J,
            sum(w[T] * (task.f if k in T else task.J @ hard[T]) for T in subsets),
        )
        for k, task in enumerate(whitened)
    ]
    any_weights = hard_law(fed, levels, everything, n) - sum(w[T] * hard[T] for T in subsets)
    values = intermediate_values(M, tasks, blending="chain")
    chain = task_torque(M, tasks, "chain")
    unchanged = task_torque(
        M, [t.replace(f=f, activation=1.0) for t, f in zip(tasks, values, strict=True)]
    )
    gaps = (dropping - blend, keeping - dropping, any_weights, unchanged - chain)
    return [float(np.linalg.norm(gap)) / scale for gap in gaps]


def recursion(
    whitened: list[WhitenedTask], levels: list[Level], h: list[float], n: int, drop: bool
) -> np.ndarray:
    """Return û by intermediate desired values, with or without task sets of activation 0."""

    def solve(present: frozenset[int], values: Sequence[np.ndarray]) -> np.ndarray:
        fed = [WhitenedTask(task.J, f) for task, f in zip(whitened, values, strict=True)]
        return hard_law(fed, levels, present, n)

    desired = [task.f for task in whitened]
    rule = Recursion(desired, h, solve, lambda k, u: whitened[k].J @ u, drop_inactive=drop)
    return rule.command(frozenset(range(len(whitened))))


def buffer_width() -> dict[str, str]:
    """Return the steepest torque on the way into the singularity, N·m per 0.001/kg, per buffer."""
    c = curves.stretching()
    return {
        "buffer 0.01 to 0.02": f"{curves.steepest(c.sigma, c.by_sigma):.2f}",
        "buffer 0.01 to 0.08": f"{curves.steepest(c.sigma, c.wide):.3f}",
    }


def controllers() -> dict[str, str]:
    """Return how far four ways of control miss their own stack without task set 1, at h₁ → 0."""
    ways = {
        "weighted least squares with damping": weighted_damped,
        "strict priorities, pseudo-inverse": lambda p, tasks: task_torque(p.A, tasks),
        "strict priorities, damped inverse": damped_hierarchy,
        "strict priorities, σ buffer": lambda p, tasks: task_torque(
            p.A, tasks, singular=SigmaBuffer(0.2, 2.0)
        ),
    }
    found = {}
    for name, solve in ways.items():
        gaps = []
        for seed in range(200):
            p = Pair(seed)
            alone = solve(p, [TaskSet(p.J2, p.f2, 1)])
            kept = TaskSet(p.J1, p.J1 @ p.Ai @ alone, 0)
            gaps.append(relative(solve(p, [kept, TaskSet(p.J2, p.f2, 1)]), alone))
        found[name] = percent(float(np.median(gaps)))
    return found


def weighted_damped(p: Pair, tasks: list[TaskSet]) -> np.ndarray:
    """Minimise Σ ‖J_k A⁻¹ Γ − f_k‖² + 0.1 Γᵀ A⁻¹ Γ, all task sets together."""
    J = np.concatenate([t.J for t in tasks])
    f = np.concatenate([t.f for t in tasks])
    return J.T @ np.linalg.solve(J @ p.Ai @ J.T + 0.1 * np.eye(len(f)), f)


def damped_hierarchy(p: Pair, tasks: list[TaskSet]) -> np.ndarray:
    """Descend the levels with damped inverses and the projectors that go with them."""
    tau, NT = np.zeros(7), np.eye(7)
    for task in sorted(tasks, key=lambda t: t.priority):
        JN = task.J @ NT.T
        Lambda = np.linalg.inv(JN @ p.Ai @ JN.T + 0.1 * np.eye(len(task.f)))
        tau = tau + JN.T @ Lambda @ (task.f - task.J @ p.Ai @ tau)
        NT = NT @ (np.eye(7) - JN.T @ (p.Ai @ JN.T @ Lambda).T)
    return tau


def percent(ratio: float) -> str:
    """Write a ratio in percent, or as a bound where only rounding is left."""
    return bound(ratio) if ratio < ROUNDING else f"{100 * ratio:.1f} %"


def bound(ratio: float, rounding: float = ROUNDING) -> str:
    """Write a relative difference, or the bound below which it is rounding."""
    return f"< {rounding:.0e}" if ratio < rounding else f"{ratio:.1e}"


def tables() -> dict[str, list[str]]:
    """Return every measured row of docs/theory.md: claim → cells."""
    rows = {claim: list(cells) for claim, cells in printed_equations().items()}
    for table in (split_at_the_edge(), buffer_width(), theorem(), controllers()):
        rows.update({claim: [cell] for claim, cell in table.items()})
    return rows


if __name__ == "__main__":
    for claim, cells in tables().items():
        print(f"| {claim} | {' | '.join(cells)} |")
