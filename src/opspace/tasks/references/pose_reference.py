"""A pose from a position and an orientation that move on their own."""

from __future__ import annotations

import numpy as np

from opspace.tasks.references.sample import Reference, Sample
from opspace.tasks.rotation import as_rotation, homogeneous


class PoseReference:
    """Joins a position reference and an orientation reference for a pose task.

    Args:
        position: Reference with x, v and a (3,).
        orientation: Reference with x a rotation matrix or quaternion wxyz, v and a (3,).
    """

    def __init__(self, position: Reference, orientation: Reference) -> None:
        self.position = position
        self.orientation = orientation

    def __call__(self, t: float, /) -> Sample:
        """Return the desired (4, 4) pose and its (6,) rates at time t, s."""
        linear, angular = self.position(t), self.orientation(t)
        R = angular.x
        if R.shape == (4,):
            R = as_rotation(R, "PoseReference: orientation")
        return Sample(
            homogeneous(linear.x, R),
            np.concatenate((linear.v, angular.v)),
            np.concatenate((linear.a, angular.a)),
        )
