"""What all contacts have in common."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError, unknown_name
from opspace.law.contact_forces import NORMAL, ForceSet
from opspace.law.scalars import STILLING
from opspace.tasks.known_attributes import KnownAttributes
from opspace.tasks.rotation import cross, skew
from opspace.tasks.validation import Array, finite_array

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

STIFF = 1e3
"""How much harder a contact keeps a force that is wanted of it than one that nobody asked for."""
MOST_WEIGHTS = 3.0
"""Largest normal force of a contact where none is given, in weights of the robot."""
GRAVITY = 9.81


class ContactTerms(NamedTuple):
    """A contact at one state, in its own axes.

    Attributes:
        J: (m, n) Jacobian of the contact's point.
        acceleration: (m,) J q̈ that keeps it where it is, −k_d J v − J̇ v.
        axes: (3, 3) its axes in the world, as columns, z out of the surface.
        point: (3,) where it is in the world, m.
    """

    J: Array
    acceleration: Array
    axes: Array
    point: Array


class GroundContact(KnownAttributes, ABC):
    """A place at which the robot touches something that does not move.

    The contact is a motion, J q̈ = −k_d J v − J̇ v, above every task, and a force λ inside its cone.
    In a stack both come and go with one progress: motion before force on the way in, force before
    motion on the way out. See `opspace.SoleContact`, `opspace.EdgeContact` and `opspace.PointContact`.

    Attributes:
        name: Name of the contact, unique within a stack.
        held: Which m components of the motion (velocity, angular velocity) it holds, in its own axes;
            those of its force are the same.
        frame: Name of the frame that touches.
        offset: (3,) its point in that frame, m.
        friction: μ.
        activation: A function (robot, t) -> [0, 1] that the progress of the contact is multiplied with
            at every tick, or None for 1.
    """

    activation: Callable[[Robot, float], float] | None = None
    held: tuple[int, ...]

    def __init__(
        self,
        frame: str,
        *,
        offset: ArrayLike,
        friction: float,
        force: ArrayLike | None,
        max_force: float | None,
        name: str | None,
    ) -> None:
        self.frame = frame
        self.name = frame if name is None else name
        if not self.name:
            raise InputError("a contact needs a name that is not empty")
        self.offset = finite_array(offset, (3,), f"contact {self.name!r}: offset")
        self.friction = self._above_zero(friction, "friction")
        self._most = None if max_force is None else self._above_zero(max_force, "max_force")
        self._weight = 0.0
        self._id = -1
        self.force = force

    def _above_zero(self, value: float, what: str) -> float:
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"contact {self.name!r}: {what} must be above 0, got {value}")
        return float(value)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r}, friction={self.friction:g})"

    @property
    def force(self) -> Array | None:
        """Force on the robot that is wanted, (3,) in the contact's axes, N, or None for whatever serves.

        A number is a normal force. It may be assigned at any time and is read at the next tick; the
        torque is as smooth as what is assigned. From None to a value it steps: begin with a value.
        """
        return self._force

    @force.setter
    def force(self, value: ArrayLike | None) -> None:
        if value is None:
            self._force = None
            return
        what = f"contact {self.name!r}: force"
        wanted = np.zeros(3)
        if np.ndim(value):
            wanted[:] = finite_array(value, (3,), what)
        else:
            wanted[NORMAL] = float(finite_array([value], (1,), what)[0])  # pyright: ignore[reportArgumentType]
        wanted.flags.writeable = False
        self._force = wanted

    @property
    def rows(self) -> int:
        """Number of its rows, m."""
        return len(self.held)

    @property
    def frame_id(self) -> int:
        """Number of its frame on the robot, −1 before it is bound."""
        return self._id

    @property
    def max_force(self) -> float:
        """Largest normal force, N; where none is given three weights of the robot, once bound."""
        return MOST_WEIGHTS * self._weight if self._most is None else self._most

    def bind(self, robot: Robot) -> None:
        """Look up the frame on a robot.

        Args:
            robot: The robot.

        Raises:
            UnknownNameError: It has no such frame.
        """
        if self.frame not in robot.frame_names:
            raise unknown_name(f"frame of {robot.name}", self.frame, robot.frame_names)
        at_rest = robot.fresh()
        at_rest.update(robot.q_reference, np.zeros(robot.nv))
        self._weight = GRAVITY * float(at_rest.M[0, 0])
        self._id = robot.frame_id(self.frame)
        if activation := self.activation:
            bind = getattr(activation, "bind", None)
            if bind is not None:
                bind(robot)

    def evaluate(self, robot: Robot) -> ContactTerms:
        """Return the terms of the contact at the robot's present state.

        Args:
            robot: The robot given to ``bind``, updated.

        Returns:
            The terms.
        """
        rotation, drift = robot.rotation(self._id), robot.drift(self._id)
        J, omega = robot.jacobian(self._id), robot.velocity(self._id)[3:]
        arm = rotation @ self.offset
        axes = self._axes(rotation)
        moving = np.concatenate([J[:3] - skew(arm) @ J[3:], J[3:]])
        turning = cross(omega, cross(omega, arm)) + cross(drift[3:], arm)
        carried = np.concatenate([drift[:3] + turning, drift[3:]])
        held = list(self.held)
        own = np.concatenate([axes.T @ moving[:3], axes.T @ moving[3:]])[held]
        beside = np.concatenate([axes.T @ carried[:3], axes.T @ carried[3:]])[held]
        stilled = -STILLING * (own @ robot.v) - beside
        return ContactTerms(own, stilled, axes, robot.position(self._id) + arm)

    def force_set(self, terms: ContactTerms, activation: float) -> ForceSet:
        """Describe the force for the law.

        Args:
            terms: What `evaluate` gave.
            activation: h_f.

        Returns:
            The force set.
        """
        metric, reference = self.shares()
        return ForceSet(terms.J, self.cone(), metric, activation, self.max_force, reference)

    def shares(self) -> tuple[Array, Array]:
        """Return the diagonal of R with which it takes part in sharing, and the force wanted of it.

        Returns:
            R, (m,), and λ_ref, (m,) N and N·m.
        """
        reference = np.zeros(self.rows)
        force = self._force
        if force is not None:
            reference[:3] = force
        return (1.0 if force is None else STIFF) * self.metric(), reference

    def wrench(self, force: Array) -> Array:
        """Write a force λ, (m,), as (6,) force and moment in the contact's axes, N and N·m."""
        found = np.zeros(6)
        found[list(self.held)] = force
        return found

    @abstractmethod
    def cone(self) -> Array:
        """Return the rows C, (k, m), of C λ <= 0."""

    @abstractmethod
    def metric(self) -> Array:
        """Return the diagonal of R, (m,), in which forces are shared."""

    @abstractmethod
    def _axes(self, rotation: Array) -> Array:
        """Return the contact's axes in the world, (3, 3), from those of its frame."""
