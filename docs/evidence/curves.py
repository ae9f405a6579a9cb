"""Curves of docs/theory.md on planar arms: torque over an activation and over a singular value."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import planar_arm

from opspace.law import SigmaBuffer, TaskSet, task_torque

PUBLISHED = SigmaBuffer(0.01, 0.02)
"""The buffer of the paper, 1/kg."""
WIDE = SigmaBuffer(0.01, 0.08)
"""Seven times as wide."""
POINTS = 600


class Insertion(NamedTuple):
    """Torque of the second joint of a four-link arm while the tip's orientation is inserted."""

    h: np.ndarray
    printed: np.ndarray
    compensated: np.ndarray
    without: float
    with_both: float


def insertion() -> Insertion:
    """Insert the orientation (one row) above the tip's position (two rows)."""
    q = np.array([0.4, 0.7, 0.5, -0.3])
    M, J = planar_arm.inertia(q), planar_arm.tip_jacobian(q)
    position = TaskSet(J, [1.0, -2.0], priority=1)
    orientation = TaskSet(np.ones((1, 4)), [4.0])
    h = np.linspace(0.0, 1.0, 101)

    def second_joint(coupling: str) -> np.ndarray:
        stacks = [[orientation.replace(activation=x), position] for x in h]
        return np.array([task_torque(M, stack, coupling=coupling)[1] for stack in stacks])

    return Insertion(
        h,
        second_joint("as-printed"),
        second_joint("compensated"),
        float(task_torque(M, [position])[1]),
        float(task_torque(M, [orientation, position])[1]),
    )


class Stretching(NamedTuple):
    """Torque of the second joint of a three-link arm that is stretched out, over its weakest σ."""

    sigma: np.ndarray
    unprotected: np.ndarray
    cut: np.ndarray
    by_jacobian: np.ndarray
    by_sigma: np.ndarray
    wide: np.ndarray


@cache
def stretching() -> Stretching:
    """Straighten the arm with a constant acceleration wanted outwards and sideways."""
    rows = [stretched(bend) for bend in np.linspace(0.02, 0.6, POINTS)]
    return Stretching(*np.array(rows).T)


def stretched(bend: float) -> list[float]:
    """Return σ and the torques of joint 2, N·m, at one posture; ``bend`` = 0 is straight."""
    q = np.array([0.3, 0.9, 0.5]) * [1.0, bend, bend]
    M, J = planar_arm.inertia(q), planar_arm.tip_jacobian(q)
    outwards = np.array([np.cos(0.3), np.sin(0.3)])
    f = 1.5 * outwards + 1.0 * np.array([-outwards[1], outwards[0]])
    sigma, U = np.linalg.eigh(J @ np.linalg.solve(M, J.T))
    full = part(M, J, f, np.eye(2))
    weakest = float(sigma[0])
    by_jacobian = full if weakest >= PUBLISHED.upper else split_by_jacobian(M, J, f, weakest)
    return [
        weakest,
        float(full[1]),
        float((full if weakest > 0.015 else part(M, J, f, U[:, 1:]))[1]),
        float(by_jacobian[1]),
        float(task_torque(M, [TaskSet(J, f)], singular=PUBLISHED)[1]),
        float(task_torque(M, [TaskSet(J, f)], singular=WIDE)[1]),
    ]


def part(M: np.ndarray, J: np.ndarray, f: np.ndarray, U: np.ndarray) -> np.ndarray:
    """Return the torque of the rows Uᵀ J alone, divided by their own inertia."""
    rows = U.T @ J
    return rows.T @ np.linalg.solve(rows @ np.linalg.solve(M, rows.T), U.T @ f)


def split_by_jacobian(M: np.ndarray, J: np.ndarray, f: np.ndarray, sigma: float) -> np.ndarray:
    """Return the sum of two parts along the singular vectors of J, the weak one faded by h(σ)."""
    U = np.linalg.svd(J)[0]
    return part(M, J, f, U[:, :1]) + PUBLISHED.activation(sigma) * part(M, J, f, U[:, 1:])


def steepest(sigma: np.ndarray, torque: np.ndarray) -> float:
    """Return the largest change of a torque, N·m per 0.001/kg of σ."""
    return float(np.max(np.abs(np.diff(torque) / np.diff(sigma)))) * 1e-3
