"""MuJoCo's motion axes and placements in the form that compiled code reads."""

from __future__ import annotations

from typing import Any

import numpy as np


class WorldAxes:
    """Motion axes about the world's origin, and placements with rotations by columns.

    All views are held: making one costs as much as the mathematics.

    Attributes:
        axes: (n, 6) motion that a unit of each velocity gives to a body, linear then angular.
        placement: (bodies, 12) rotations by columns, then positions, m.

    Args:
        model: MuJoCo's model.
        data: Its data, which is read by every `fill`.
    """

    def __init__(self, model: Any, data: Any) -> None:
        self.axes = np.zeros((model.nv, 6))
        self.placement = np.zeros((model.nbody, 12))
        self._across = np.zeros((3, 3))
        angular, linear = data.cdof[:, :3], data.cdof[:, 3:]
        # MuJoCo's axes are about the centre of mass of their tree, whose joints stand together.
        root = model.body_rootid[model.dof_bodyid]
        ends = [*(np.flatnonzero(np.diff(root)) + 1).tolist(), model.nv] if model.nv else []
        self._trees = [
            (data.subtree_com[root[end - 1]], angular[first:end], self.axes[first:end, :3])
            for first, end in zip([0, *ends], ends, strict=False)
        ]
        self._moment, self._linear = self.axes[:, :3], linear
        self._copies = [
            (self.axes[:, 3:], angular),
            (self.placement[:, :9].reshape(-1, 3, 3), _by_columns(data.xmat)),
            (self.placement[:, 9:], data.xpos),
        ]

    def fill(self) -> None:
        """Bring both up to date with the data."""
        across = self._across
        for com, angular, found in self._trees:
            x, y, z = com.tolist()
            across[0, 1], across[0, 2], across[1, 2] = z, -y, x
            across[1, 0], across[2, 0], across[2, 1] = -z, y, -x
            np.matmul(angular, across, out=found)
        self._moment += self._linear
        for to, of in self._copies:
            np.copyto(to, of)


def _by_columns(rotations: np.ndarray) -> np.ndarray:
    return rotations.reshape(-1, 3, 3).transpose(0, 2, 1)
