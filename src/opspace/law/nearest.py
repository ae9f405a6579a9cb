"""The nearest joint acceleration within bounds: the last line behind limits that push each other."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from opspace.law.scalars import HARD, SOFT, UNBOUNDED


def nearest_acceleration(
    L: Float[np.ndarray, "n n"],
    acceleration: Float[np.ndarray, " n"],
    lower: Float[np.ndarray, " n"],
    upper: Float[np.ndarray, " n"],
    torque_lower: Float[np.ndarray, " n"],
    torque_upper: Float[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """Find the acceleration within bounds that is nearest in the inertia metric.

        min (q̈ − q̈₀)ᵀ A (q̈ − q̈₀) + Σ excess²/softness
        lower <= q̈ <= upper,   torque_lower <= A q̈ <= torque_upper

    with every bound taken as a unit normal in the metric. The answer is a continuous function of
    everything given. In x = Lᵀ q̈ it is a projection; its dual is a least-squares problem in
    multipliers that are not negative.

    Args:
        L: (n, n) Cholesky factor of the inertia A.
        acceleration: (n,) q̈₀, rad/s².
        lower: (n,) least accelerations, -inf where there is none.
        upper: (n,) largest accelerations, inf where there is none.
        torque_lower: (n,) least torques beside the bias, N·m.
        torque_upper: (n,) largest torques beside the bias, N·m.

    Returns:
        (n,) q̈, rad/s².
    """
    from scipy.optimize import nnls  # noqa: PLC0415 - slow to import, and for the readable form only

    n = acceleration.size
    joints, motors = np.linalg.solve(L, np.eye(n)).T, L
    rows = np.concatenate([joints, -joints, motors, -motors])
    bounds = np.concatenate([upper, -lower, torque_upper, -torque_lower])
    softness = np.repeat([SOFT, HARD], 2 * n)
    there = bounds < UNBOUNDED
    if not np.any(there):
        return acceleration
    size = np.linalg.norm(rows[there], axis=1)
    A, b = rows[there] / size[:, None], bounds[there] / size
    x = L.T @ acceleration
    R = np.linalg.cholesky(A @ A.T + np.diag(softness[there])).T
    multipliers, _ = nnls(R, np.linalg.solve(R.T, A @ x - b))
    return np.linalg.solve(L.T, x - A.T @ multipliers)


def excess(
    acceleration: Float[np.ndarray, " n"],
    lower: Float[np.ndarray, " n"],
    upper: Float[np.ndarray, " n"],
) -> float:
    """Tell by how much accelerations leave their bounds.

    Args:
        acceleration: (n,) rad/s².
        lower: (n,) least accelerations.
        upper: (n,) largest accelerations.

    Returns:
        The largest excess over max(1, |bound|), below or at zero where there is none.
    """
    over = np.concatenate([acceleration - upper, lower - acceleration])
    bound = np.abs(np.concatenate([upper, lower]))
    there = bound < UNBOUNDED
    return float(np.max(over[there] / np.maximum(1.0, bound[there]), initial=-np.inf))
