"""A foot that stands flat on a surface."""

from __future__ import annotations

from numpy.typing import ArrayLike

from opspace.contacts.ground_contact import GroundContact
from opspace.law.cones import sole_cone, sole_metric
from opspace.tasks.validation import Array


class SoleContact(GroundContact):
    """Holds a rectangle flat on a surface: six rows, and every force that its corners can carry.

    Args:
        frame: Name of the foot's frame; its z points out of the surface into the robot.
        half: Half the sides of the rectangle along the frame's x and y, m.
        offset: (3,) the rectangle's middle in the frame, m.
        friction: μ of a pyramid. It lies inside the real cone where it is at most the real μ over √2.
        force: Force on the robot that is wanted, see `force`.
        max_force: Largest normal force, N; None is three times the robot's weight.
        name: Name of the contact; None is that of the frame.

    Raises:
        InputError: A number that cannot be used.
    """

    held = (0, 1, 2, 3, 4, 5)

    def __init__(
        self,
        frame: str,
        half: tuple[float, float],
        *,
        offset: ArrayLike = (0.0, 0.0, 0.0),
        friction: float = 0.5,
        force: ArrayLike | None = None,
        max_force: float | None = None,
        name: str | None = None,
    ) -> None:
        super().__init__(
            frame, offset=offset, friction=friction, force=force, max_force=max_force, name=name
        )
        x, y = half
        self.half = (self._above_zero(x, "half"), self._above_zero(y, "half"))

    def cone(self) -> Array:
        """Return the rows of the four corners' friction pyramids together, (16, 6)."""
        return sole_cone(self.half, self.friction)

    def metric(self) -> Array:
        """Return what each component is worth of what the sole can carry, (6,)."""
        return sole_metric(self.half, self.friction)

    def _axes(self, rotation: Array) -> Array:
        return rotation
