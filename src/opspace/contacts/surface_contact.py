"""Contacts whose frame turns on a surface that does not."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from opspace.contacts.ground_contact import GroundContact
from opspace.errors import InputError
from opspace.law.contact_forces import NORMAL
from opspace.tasks.validation import Array, finite_array


class SurfaceContact(GroundContact):
    """What points and edges have in common: the surface is told, not seen from the frame.

    Args:
        frame: Name of the frame that touches.
        offset: (3,) the contact's point in the frame, m.
        normal: (3,) direction out of the surface, in the world.
        friction: μ of the pyramid, see `opspace.SoleContact`.
        force: Force on the robot that is wanted, see `force`.
        max_force: Largest normal force, N; None is three times the robot's weight.
        name: Name of the contact; None is that of the frame.

    Raises:
        InputError: A number that cannot be used.
    """

    def __init__(
        self,
        frame: str,
        *,
        offset: ArrayLike,
        normal: ArrayLike,
        friction: float,
        force: ArrayLike | None,
        max_force: float | None,
        name: str | None,
    ) -> None:
        super().__init__(
            frame, offset=offset, friction=friction, force=force, max_force=max_force, name=name
        )
        z = self._direction(normal, "normal")
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        self._surface = np.stack([x, np.cross(z, x), z], axis=1)

    def _direction(self, value: ArrayLike, what: str) -> Array:
        """Check a direction and give it the length 1."""
        found = finite_array(value, (3,), f"contact {self.name!r}: {what}")
        if not np.linalg.norm(found) > 0.0:
            raise InputError(f"contact {self.name!r}: the {what} must not be zero")
        return found / np.linalg.norm(found)

    @property
    def surface(self) -> Array:
        """Axes of the surface in the world, (3, 3), as columns, z out of it."""
        return self._surface

    @property
    def normal(self) -> Array:
        """Direction out of the surface, (3,) in the world, of length 1."""
        return self._surface[:, NORMAL].copy()
