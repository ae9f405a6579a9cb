"""What is controlled of a motion: its position, its orientation, or both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from opspace.tasks.motions import Motion
from opspace.tasks.pose_forms import as_pose
from opspace.tasks.references.sample import Sample
from opspace.tasks.rotation import as_rotation, homogeneous
from opspace.tasks.rotation_error import RotationError
from opspace.tasks.validation import Array, finite_array
from opspace.tasks.ways import Pace, PoseWay, RotationWay, VectorWay, Way


class Quantity(Protocol):
    """A part of a motion that can have a target.

    Attributes:
        block: Its rows among linear then angular.
        units: Unit of each of these rows.
        speed_groups: Rows that share a speed limit.
    """

    block: slice
    units: tuple[str, ...]
    speed_groups: tuple[slice, ...]

    def check(self, value: ArrayLike, what: str) -> Array:
        """Return a target value in the form that ``error`` reads, or raise InputError."""
        ...

    def value(self, motion: Motion) -> Array:
        """Return the present value in the same form."""
        ...

    def error(self, motion: Motion, desired: Array) -> Array:
        """Return x_d − x, (k,)."""
        ...

    def way(self, now: Sample, goal: Array, t: float, paces: Sequence[Pace]) -> Way:
        """Return the way from what is followed at time t to a value, one pace for each speed group."""
        ...

    def reset(self) -> None:
        """Forget the past."""
        ...


class Position:
    """Position x (3,): error x_d − x."""

    block = slice(0, 3)
    units: tuple[str, ...] = ("m", "m", "m")
    speed_groups: tuple[slice, ...] = (slice(None),)

    def check(self, value: ArrayLike, what: str) -> Array:
        """Return (3,) m."""
        return finite_array(value, (3,), what)

    def value(self, motion: Motion) -> Array:
        """Return the position."""
        return motion.position

    def error(self, motion: Motion, desired: Array) -> Array:
        """Return x_d − x, m."""
        return desired - motion.position

    def way(self, now: Sample, goal: Array, t: float, paces: Sequence[Pace]) -> Way:
        """Return the straight way."""
        return VectorWay.to(now, goal, t, paces[0])

    def reset(self) -> None:
        """Do nothing: a position has no past."""


class Orientation:
    """Orientation R (3, 3): error R log(Rᵀ R_d) = log(R_d Rᵀ), kept continuous past half a turn.

    It is continuous while R_d is; a target that jumps is turned to the short way.
    """

    block = slice(3, 6)
    units: tuple[str, ...] = ("rad", "rad", "rad")
    speed_groups: tuple[slice, ...] = (slice(None),)

    def __init__(self) -> None:
        self.turn = RotationError()

    def check(self, value: ArrayLike, what: str) -> Array:
        """Return a rotation matrix from one or from a quaternion wxyz."""
        return as_rotation(value, what)

    def value(self, motion: Motion) -> Array:
        """Return the rotation matrix."""
        return motion.rotation

    def error(self, motion: Motion, desired: Array) -> Array:
        """Return the rotation vector from R to R_d, rad."""
        self.turn.follow(desired)
        return self.turn(desired @ motion.rotation.T)

    def way(self, now: Sample, goal: Array, t: float, paces: Sequence[Pace]) -> Way:
        """Return the turn about one axis."""
        return RotationWay.to(now, goal, t, paces[0])

    def reset(self) -> None:
        """Forget which way round the error went."""
        self.turn.reset()


class Pose:
    """Position and orientation as a homogeneous matrix (4, 4)."""

    block = slice(0, 6)
    units: tuple[str, ...] = ("m", "m", "m", "rad", "rad", "rad")
    speed_groups: tuple[slice, ...] = (slice(0, 3), slice(3, 6))

    def __init__(self) -> None:
        self._orientation = Orientation()
        self.turn = self._orientation.turn

    def check(self, value: ArrayLike, what: str) -> Array:
        """Return the (4, 4) matrix of a pose in any of the accepted forms."""
        return as_pose(value, what)

    def value(self, motion: Motion) -> Array:
        """Return the (4, 4) matrix."""
        return homogeneous(motion.position, motion.rotation)

    def error(self, motion: Motion, desired: Array) -> Array:
        """Return position error above rotation vector, m and rad."""
        turn = self._orientation.error(motion, desired[:3, :3])
        return np.concatenate((desired[:3, 3] - motion.position, turn))

    def way(self, now: Sample, goal: Array, t: float, paces: Sequence[Pace]) -> Way:
        """Return both ways."""
        return PoseWay.to(now, goal, t, *paces)

    def reset(self) -> None:
        """Forget which way round the rotation error went."""
        self._orientation.reset()
