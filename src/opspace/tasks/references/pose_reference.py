"""A pose from a position and an orientation that move on their own."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.references.sample import Constant, Reference, Sample
from opspace.tasks.references.start import begun
from opspace.tasks.rotation import as_rotation, homogeneous
from opspace.tasks.validation import Array, finite_array, shown


class PoseReference:
    """Joins a position and an orientation, of which either may move, for a pose task.

    Args:
        position: Reference with x, v and a (3,), or a position that stays, m.
        orientation: Reference with x a rotation matrix or quaternion wxyz, v and a (3,), or an
            orientation that stays.

    Raises:
        InputError: A position or orientation that is none.
    """

    def __init__(self, position: Reference | ArrayLike, orientation: Reference | ArrayLike) -> None:
        self.position = position if callable(position) else Constant(position)
        self.orientation = orientation if callable(orientation) else Constant(orientation)
        if isinstance(self.position, Constant):
            finite_array(self.position.value, (3,), "PoseReference: position")
        if isinstance(self.orientation, Constant):
            R = as_rotation(self.orientation.value, "PoseReference: orientation")
            self.orientation = Constant(R)

    def begin_at(self, t: float) -> PoseReference:
        """Return the reference whose parts begin at time t [s] if they have no start time."""
        parts = (begun(self.position, t), begun(self.orientation, t))
        return self if parts == (self.position, self.orientation) else PoseReference(*parts)

    def __call__(self, t: float, /) -> Sample:
        """Return the desired (4, 4) pose and its (6,) rates at time t, s.

        Raises:
            InputError: A part that gave something else than a position or an orientation.
        """
        linear = _checked(self.position(t), "position")
        angular = _checked(self.orientation(t), "orientation")
        R = angular.x
        if R.shape != (3, 3):
            R = as_rotation(R, "PoseReference: orientation")
        return Sample(
            homogeneous(finite_array(linear.x, (3,), "PoseReference: position"), R),
            np.concatenate((linear.v, angular.v)),
            np.concatenate((linear.a, angular.a)),
        )


def _checked(sample: object, part: str) -> Sample:
    if not isinstance(sample, tuple) or len(sample) != 3:
        raise InputError(
            f"PoseReference: the {part} must give a Sample(x, v, a), not {shown(sample)}"
        )
    x, v, a = sample
    return Sample(np.asarray(x), _rate(v, part, "velocity"), _rate(a, part, "acceleration"))


def _rate(value: ArrayLike, part: str, what: str) -> Array:
    if np.size(value) == 0:
        return np.zeros(3)
    return finite_array(value, (3,), f"PoseReference: {part} {what}")
