"""The forms in which a pose can be given."""

from __future__ import annotations

from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.rotation import as_rotation, homogeneous
from opspace.tasks.validation import Array, finite_array, numbers


def as_pose(value: ArrayLike, what: str) -> Array:
    """Read a pose.

    Args:
        value: (4, 4) homogeneous matrix, (7,) position and quaternion [x y z, qw qx qy qz], or a
            pair (position, orientation) with the orientation as matrix or quaternion.
        what: What the value is, at the start of the error message.

    Returns:
        (4, 4) homogeneous matrix with an orthonormal rotation, read-only.

    Raises:
        InputError: None of these forms, not finite, or not a rotation.
    """
    if isinstance(value, tuple | list) and len(value) == 2:
        position, orientation = value
    else:
        position, orientation = _split(numbers(value, what), what)
    pose = homogeneous(
        finite_array(position, (3,), f"{what} position"),
        as_rotation(orientation, f"{what} orientation"),
    )
    pose.flags.writeable = False
    return pose


def _split(given: Array, what: str) -> tuple[Array, Array]:
    if given.shape == (7,):
        return given[:3], given[3:]
    if given.shape != (4, 4):
        raise InputError(
            f"{what} must be a (4, 4) matrix, seven numbers [x y z, qw qx qy qz] "
            f"or a pair (position, orientation), not of shape {given.shape}"
        )
    if given[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        raise InputError(f"{what}: the last row of a (4, 4) pose must be 0 0 0 1")
    return given[:3, 3], given[:3, :3]
