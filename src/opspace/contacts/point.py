"""A point that presses against a surface."""

from __future__ import annotations

from numpy.typing import ArrayLike

from opspace.contacts.surface_contact import SurfaceContact
from opspace.law.cones import point_cone, point_metric
from opspace.tasks.validation import Array


class PointContact(SurfaceContact):
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

    held = (0, 1, 2)

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
            frame,
            offset=offset,
            normal=normal,
            friction=friction,
            force=force,
            max_force=max_force,
            name=name,
        )

    def cone(self) -> Array:
        """Return the rows of the friction pyramid, (4, 3)."""
        return point_cone(self.friction)

    def metric(self) -> Array:
        """Return what each component is worth of what the point can carry, (3,)."""
        return point_metric(self.friction)

    def _axes(self, rotation: Array) -> Array:
        return self._surface
