"""What a reference is: desired value, velocity and acceleration as functions of time."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from opspace.tasks.pose_forms import as_pose
from opspace.tasks.validation import Array, finite_array


class Sample(NamedTuple):
    """Desired motion at one instant.

    Attributes:
        x: Desired value in the form of the task's target.
        v: (k,) desired velocity, m/s or rad/s; no numbers at all, (0,), are rest.
        a: (k,) desired acceleration, m/s² or rad/s²; likewise.
    """

    x: Array
    v: Array
    a: Array


class Reference(Protocol):
    """A function of time, without memory, that a task can follow.

    It is asked with the time of the controller. One with a method ``begin_at(t)`` is asked for the
    reference that begins at the first tick, and that one is followed; see
    `opspace.tasks.references.start`.
    """

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        ...


class Constant:
    """Stays at a value.

    Args:
        value: Whatever the task takes as a target: (k,) or a number, a rotation matrix or a quaternion
            wxyz, or a pose in any of its forms.

    Attributes:
        value: The value.

    Raises:
        InputError: Not numbers, or not finite.
    """

    def __init__(self, value: ArrayLike) -> None:
        if _is_pair(value):
            self.value = as_pose(value, "Constant: value")
        else:
            self.value = finite_array(value, None, "Constant: value")
        # How many rates there are is said by a vector, but not by a rotation or a pose.
        as_vector = self.value.ndim < 2 and self.value.size not in (4, 7)
        rest = np.zeros(self.value.shape if as_vector else 0)
        self._sample = Sample(self.value, rest, rest)

    def __call__(self, t: float, /) -> Sample:
        """Return the value at rest."""
        del t
        return self._sample


def _is_pair(value: ArrayLike) -> bool:
    """Tell whether this is a position beside an orientation."""
    if not isinstance(value, tuple | list) or len(value) != 2:
        return False
    try:
        return np.shape(value[0]) == (3,) and np.shape(value[1]) in ((4,), (3, 3))
    except ValueError:
        return False  # rows of different lengths, which are refused as numbers
