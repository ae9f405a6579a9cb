"""Other laws for partly active task sets, in whitened coordinates (see `opspace.law.hierarchy`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from opspace.law import TaskSet, Weighted
from opspace.law.hierarchy import RANK_TOLERANCE, WhitenedTask, levels_of, whiten

SOFTNESS = 100.0
"""Weight of a level relative to the one below it in the weighted least squares."""

REGULARISATION = 1e-10
"""Weight of ‖û‖² relative to level 0."""

FAINTEST = 1e-3
"""Smallest weight of a level where the weights are 10 to 1."""

EDGE, LARGEST_DAMPING = 0.6, 0.1
"""Below this σ a level is damped, at σ = 0 by this λ²; multiples of the usual σ."""

Inverse = Callable[[np.ndarray, np.ndarray, float], np.ndarray]
"""(JN (m, n), activation of each row (m,), smallest singular value to count) → inverse (n, m)."""


def ten_to_one_weight(level: float) -> float:
    """Weigh a level by its number, max(10^(−level), `FAINTEST`)."""
    return max(10.0**-level, FAINTEST)


def presences(blend: Sequence[Weighted], count: int) -> list[float]:
    """Sum, for each of ``count`` task sets, the weights of the stacks that contain it."""
    found = [sum(w for w, present in blend if k in present) for k in range(count)]
    return [min(h, 1.0) for h in found]


def weighted_least_squares(
    L: np.ndarray, tasks: Sequence[TaskSet], weights: Sequence[float]
) -> np.ndarray:
    """Torque of a quadratic program without inequalities, in which a level is a weight.

    min_û Σ_k w_k ‖Ĵ_k û − f_k‖² + ε ‖û‖²

    Args:
        L: Cholesky factor of the inertia, (n, n).
        tasks: Task sets.
        weights: w_k of each, presence times the weight of its level.

    Returns:
        (n,) N·m, bias not included.
    """
    n = len(L)
    rows, wanted = [np.sqrt(REGULARISATION) * np.eye(n)], [np.zeros(n)]
    for white, weight in zip(whiten(tasks, L), weights, strict=True):
        rows.append(np.sqrt(weight) * white.J)
        wanted.append(np.sqrt(weight) * white.f)
    return L @ np.linalg.lstsq(np.concatenate(rows), np.concatenate(wanted), rcond=None)[0]


def stack_of_tasks(
    L: np.ndarray, tasks: Sequence[TaskSet], presence: Sequence[float], inverse: Inverse
) -> np.ndarray:
    """Torque of û_l = û_{l−1} + X_l (f_l − Ĵ_l û_{l−1}), N_l = N_{l−1} − X_l Ĵ_l N_{l−1}.

    Args:
        L: Cholesky factor of the inertia, (n, n).
        tasks: Task sets.
        presence: h_k of each.
        inverse: X_l from Ĵ_l N_{l−1}.

    Returns:
        (n,) N·m, bias not included.
    """
    whitened = whiten(tasks, L)
    u, N = np.zeros(len(L)), np.eye(len(L))
    for level in levels_of(tasks):
        members = sorted(k for k in level.members if presence[k] > 0.0)
        if not members:
            continue
        J, f, h = _stacked([whitened[k] for k in members], [presence[k] for k in members])
        JN = J @ N
        X = inverse(JN, h, RANK_TOLERANCE * float(np.linalg.norm(J, 2)))
        u = u + X @ (f - J @ u)
        N = N - X @ JN
    return L @ u


def _stacked(
    tasks: Sequence[WhitenedTask], presence: Sequence[float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    h = [np.full(task.f.size, value) for task, value in zip(tasks, presence, strict=True)]
    return (
        np.concatenate([t.J for t in tasks]),
        np.concatenate([t.f for t in tasks]),
        np.concatenate(h),
    )


def continuous_inverse(JN: np.ndarray, h: np.ndarray, least: float) -> np.ndarray:
    """Mansard's continuous inverse Σ_b Π_b h Π_{not b} (1 − h) (JN_b)⁺, damped near singularities.

    Rows that share an activation come and go together, so b runs over groups of rows.
    """
    groups = [np.flatnonzero(h == value) for value in np.unique(h)]
    moving = [group for group in groups if h[group[0]] < 1.0]
    always = [group for group in groups if h[group[0]] == 1.0]
    X = np.zeros(JN.T.shape)
    for size in range(len(moving) + 1):
        for chosen in combinations(range(len(moving)), size):
            on = [h[g[0]] if k in chosen else 1.0 - h[g[0]] for k, g in enumerate(moving)]
            rows = [*always, *(moving[k] for k in chosen)]
            if rows:
                rows = np.concatenate(rows)
                X[:, rows] += np.prod(on) * _damped(JN[rows], least)
    return X


def damped_inverse(JN: np.ndarray, h: np.ndarray, least: float) -> np.ndarray:
    """Damped least squares, whatever the activations."""
    del h
    return _damped(JN, least)


def _damped(JN: np.ndarray, least: float) -> np.ndarray:
    """Return Σ_i v_i √σ_i / (σ_i + λ²) u_iᵀ, with λ² rising as the smallest σ falls.

    λ² = 0.1 (1 − σ_min / 0.6)² for σ_min below 0.6 (Nakamura), else 0.
    """
    U, s, Vt = np.linalg.svd(JN, full_matrices=False)
    # Directions that the levels above have taken are not near a singularity, they are gone.
    kept = s > least
    U, s, Vt = U[:, kept], s[kept], Vt[kept]
    smallest = float(s[-1] ** 2) if s.size else EDGE
    damping = LARGEST_DAMPING * max(1.0 - smallest / EDGE, 0.0) ** 2
    return (Vt.T * (s / (s**2 + damping))) @ U.T
