"""MuJoCo's motion axes and placements in the form that compiled code reads."""

from __future__ import annotations

import numpy as np


def world_axes(cdof: np.ndarray, origins: np.ndarray, com: np.ndarray, axes: np.ndarray) -> None:
    """Bring motion axes about the centre of mass of each tree to the world's origin.

    Args:
        cdof: (n, 6) MuJoCo's axes, angular then linear.
        origins: (n,) body whose subtree's centre of mass each axis refers to.
        com: (bodies, 3) centres of mass of the subtrees, m.
        axes: (n, 6) filled, linear then angular.
    """
    x, y, z = com.take(origins, axis=0).T
    a, b, c = cdof[:, 0], cdof[:, 1], cdof[:, 2]
    axes[:, 0] = cdof[:, 3] + y * c - z * b
    axes[:, 1] = cdof[:, 4] + z * a - x * c
    axes[:, 2] = cdof[:, 5] + x * b - y * a
    axes[:, 3:] = cdof[:, :3]


def placements(first: int, xmat: np.ndarray, xpos: np.ndarray, placement: np.ndarray) -> None:
    """Write rotations (by columns) and positions into the rows from ``first`` on."""
    rows = placement[first : first + len(xpos)]
    rows[:, :9].reshape(-1, 3, 3)[:] = xmat.reshape(-1, 3, 3).transpose(0, 2, 1)
    rows[:, 9:] = xpos
