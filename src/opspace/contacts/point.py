"""A point that presses against a surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from opspace.contacts.ground_contact import GroundContact
from opspace.errors import InputError
from opspace.law.cones import point_cone, point_metric
from opspace.law.contact_forces import NORMAL
from opspace.tasks.validation import Array, finite_array


class PointContact(GroundContact):
    """Holds a point on a surface and lets its frame turn: three rows, a friction pyramid.

    Args:
        frame: Name of the frame that touches.
        offset: (3,) the point in the frame, m.
        normal: (3,) direction out of the surface, in the world.
        friction: μ of the pyramid, see `opspace.SoleContact`.
        force: Force on the robot that is wanted, see `force`: a hand that is only to touch is given
            one, else it helps to carry.
        max_force: Largest normal force, N; None is three times the robot's weight.
        name: Name of the contact; None is that of the frame.

    Raises:
        InputError: A number that cannot be used.
    """

    rows = 3

    def __init__(
        self,
        frame: str,
        *,
        offset: ArrayLike = (0.0, 0.0, 0.0),
        normal: ArrayLike = (0.0, 0.0, 1.0),
        friction: float = 0.5,
        force: ArrayLike | None = None,
        max_force: float | None = None,
        name: str | None = None,
    ) -> None:
        super().__init__(
            frame, offset=offset, friction=friction, force=force, max_force=max_force, name=name
        )
        z = finite_array(normal, (3,), f"contact {self.name!r}: normal")
        if not np.linalg.norm(z) > 0.0:
            raise InputError(f"contact {self.name!r}: the normal must not be zero")
        z = z / np.linalg.norm(z)
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        self._surface = np.stack([x, np.cross(z, x), z], axis=1)

    @property
    def surface(self) -> Array:
        """Axes of the surface in the world, (3, 3), as columns, z out of it."""
        return self._surface

    @property
    def normal(self) -> Array:
        """Direction out of the surface, (3,) in the world, of length 1."""
        return self._surface[:, NORMAL].copy()

    def cone(self) -> Array:
        """Return the rows of the friction pyramid, (4, 3)."""
        return point_cone(self.friction)

    def metric(self) -> Array:
        """Return what each component is worth of what the point can carry, (3,)."""
        return point_metric(self.friction)

    def _axes(self, rotation: Array) -> Array:
        return self._surface
