"""A straight edge on which a foot rolls or a hand rests."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from opspace.contacts.surface_contact import SurfaceContact
from opspace.law.cones import edge_cone, edge_metric
from opspace.law.contact_forces import NORMAL
from opspace.law.scalars import TINY
from opspace.tasks.validation import Array


class EdgeContact(SurfaceContact):
    """Holds a line of a frame on a surface and lets the frame turn about it: five rows.

    Toes on which a foot rolls, a heel, a hand that lies on a rail. The contact's own x is along the
    line, its z out of the surface; its forces are all that both ends can carry.

    Args:
        frame: Name of the frame that touches.
        half: Half the length of the line, m.
        along: (3,) direction of the line, in the frame. It must not be that of the normal.
        offset: (3,) the middle of the line in the frame, m.
        normal: (3,) direction out of the surface, in the world.
        friction: μ of the pyramid at either end, see `opspace.SoleContact`.
        force: Force on the robot that is wanted, see `force`.
        max_force: Largest normal force, N; None is three times the robot's weight.
        name: Name of the contact; None is that of the frame.

    Raises:
        InputError: A number that cannot be used.
    """

    held = (0, 1, 2, 4, 5)

    def __init__(
        self,
        frame: str,
        half: float,
        *,
        along: ArrayLike = (0.0, 1.0, 0.0),
        offset: ArrayLike = (0.0, 0.0, 0.0),
        normal: ArrayLike = (0.0, 0.0, 1.0),
        friction: float = 0.5,
        force: ArrayLike | None = None,
        max_force: float | None = None,
        name: str | None = None,
    ) -> None:
        super().__init__(
            frame,
            offset=offset,
            normal=normal,
            friction=friction,
            force=force,
            max_force=max_force,
            name=name,
        )
        self.half = self._above_zero(half, "half")
        self._along = self._direction(along, "direction along")

    @property
    def along(self) -> Array:
        """Direction of the line, (3,) in the frame, of length 1."""
        return self._along.copy()

    def cone(self) -> Array:
        """Return the rows of the friction pyramids of both ends together, (6, 5)."""
        return edge_cone(self.half, self.friction)

    def metric(self) -> Array:
        """Return what each component is worth of what the edge can carry, (5,)."""
        return edge_metric(self.half, self.friction)

    def _axes(self, rotation: Array) -> Array:
        z, x = self._surface[:, NORMAL], rotation @ self._along
        x = x - z * (z @ x)
        x = x / max(float(np.linalg.norm(x)), TINY)
        return np.stack([x, np.cross(z, x), z], axis=1)
