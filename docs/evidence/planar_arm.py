"""A planar arm of uniform rods in closed form: the smallest robot with a singularity."""

from __future__ import annotations

import numpy as np

LENGTH = 0.4
"""Length of every link, m."""
MASS = 2.0
"""Mass of every link, kg."""


def point_jacobian(q: np.ndarray, link: int, along: float) -> np.ndarray:
    """Return the Jacobian (2, n) of the point ``along`` metres down link ``link`` (from 0)."""
    angles = np.cumsum(q)
    reach = np.full(link + 1, LENGTH)
    reach[link] = along
    columns = np.zeros((2, q.size))
    for j in range(link + 1):
        columns[0, j] = -np.sum(reach[j:] * np.sin(angles[j : link + 1]))
        columns[1, j] = np.sum(reach[j:] * np.cos(angles[j : link + 1]))
    return columns


def tip_jacobian(q: np.ndarray) -> np.ndarray:
    """Return the Jacobian (2, n) of the tip."""
    return point_jacobian(q, q.size - 1, LENGTH)


def inertia(q: np.ndarray) -> np.ndarray:
    """Return the joint-space inertia (n, n), kg·m²."""
    M = np.zeros((q.size, q.size))
    for link in range(q.size):
        J = point_jacobian(q, link, LENGTH / 2)
        turns = (np.arange(q.size) <= link).astype(float)
        M += MASS * J.T @ J + MASS * LENGTH**2 / 12 * np.outer(turns, turns)
    return M
