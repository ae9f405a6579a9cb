"""What a reference is: desired value, velocity and acceleration as functions of time."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from opspace.tasks.validation import Array, finite_array


class Sample(NamedTuple):
    """Desired motion at one instant.

    Attributes:
        x: Desired value in the form of the task's target.
        v: (k,) desired velocity, m/s or rad/s.
        a: (k,) desired acceleration, m/s² or rad/s².
    """

    x: Array
    v: Array
    a: Array


class Reference(Protocol):
    """A function of time, without memory, that a task can follow."""

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        ...


class Constant:
    """Stays at a value.

    Args:
        value: (k,) value, or a number, in the unit of the task.

    Raises:
        InputError: Not numbers, or not finite.
    """

    def __init__(self, value: ArrayLike) -> None:
        x = finite_array(value, None, "Constant: value")
        rest = np.zeros(x.shape)
        self._sample = Sample(x, rest, rest)

    def __call__(self, t: float, /) -> Sample:
        """Return the value at rest."""
        del t
        return self._sample
