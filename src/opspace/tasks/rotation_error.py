"""The rotation from where a frame is to where it should be, as a continuous vector."""

from __future__ import annotations

import math

from opspace.law.scalars import error_length, goes_on
from opspace.tasks.rotation import quaternion_from_matrix, rotation_vector
from opspace.tasks.validation import Array
from opspace.tasks.way_round import WayRound, rotation_jumps


class RotationError(WayRound):
    """Logarithm of a rotation error that remembers which way round it went.

    The logarithm of SO(3) jumps from π to −π about its axis at half a turn. A controller that
    follows it would reverse its command there, and again with every bit of noise. This one
    follows the unit quaternion of the error continuously instead: an error that grows past π goes
    on growing about the same axis up to π + ``BRANCH_HOLD``. From there to π + ``BRANCH_END`` it
    turns into the error of the short way (`opspace.law.scalars.error_length`), again continuously:
    between two calls it changes by no more than a fixed multiple of the motion in between. Up to
    π + ``BRANCH_HOLD`` it is a logarithm; below π, without a past and after a leap (``FOLLOWED``)
    it is the plain one.

    Attributes:
        previous: Quaternion wxyz of the last error, None without a past.
    """

    jumps = staticmethod(rotation_jumps)

    def __call__(self, E: Array) -> Array:
        """Return the rotation vector of the error E = R_d Rᵀ.

        Args:
            E: (3, 3) rotation that leads from the present to the desired orientation.

        Returns:
            (3,) rotation vector, rad.
        """
        q = quaternion_from_matrix(E)
        previous = self.previous
        if previous is not None:
            agreement = sum(a * b for a, b in zip(q, previous, strict=True))
            if goes_on(agreement, q[0]):
                q = (-q[0], -q[1], -q[2], -q[3])
        self.previous = q
        phi = rotation_vector(q)
        angle = math.hypot(*phi.tolist())
        length = error_length(angle)
        return phi if length == angle else phi * (length / angle)
