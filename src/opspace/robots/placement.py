"""Placements that people give, frames of one's own, and where compiled code finds them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError

if TYPE_CHECKING:
    from opspace.robots.motion_axes import FramePlace

ORTHONORMAL = 1e-6
"""Largest error of a rotation matrix that is taken for rounding."""


@dataclass(frozen=True)
class AddedFrame:
    """A frame that is fixed to one of the model's own.

    Attributes:
        parent: Id of that frame.
        rotation: (3, 3) of its axes there.
        position: (3,) of its origin there, m.
    """

    parent: int
    rotation: np.ndarray
    position: np.ndarray

    def after(self, before: AddedFrame) -> AddedFrame:
        """Return this frame, given on ``before``, as one on the parent of that."""
        return AddedFrame(
            before.parent,
            before.rotation @ self.rotation,
            before.position + before.rotation @ self.position,
        )


class FrameTable:
    """Names of a robot's frames; all its copies with a state of their own have one in common.

    Attributes:
        names: Every name; the index is the frame's id.
        ids: The ids by name.
        added: The frames that are not the model's own, by id.

    Args:
        names: Those of the model.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.ids = {name: i for i, name in enumerate(names)}
        self.added: dict[int, AddedFrame] = {}

    def add(self, name: str, frame: AddedFrame) -> int:
        """Add a frame; return its id."""
        before = self.added.get(frame.parent)
        id_ = len(self.names)
        self.added[id_] = frame if before is None else frame.after(before)
        self.ids[name] = id_
        self.names = (*self.names, name)
        return id_


class FramePlaces(Mapping[int, "FramePlace"]):
    """Where frames are fixed: the model's own, and those that are added, also later.

    Args:
        own: Places of the model's own frames by id.
        added: The frames that are added by id; it may grow.
    """

    def __init__(self, own: Mapping[int, FramePlace], added: Mapping[int, AddedFrame]) -> None:
        self._own, self._added = own, added

    def __getitem__(self, frame: int) -> FramePlace:
        added = self._added.get(frame)
        if added is None:
            return self._own[frame]
        place = self._own[added.parent]
        rotation, position = place.local[:9].reshape(3, 3).T, place.local[9:]
        there = (rotation @ added.rotation).T.reshape(9), position + rotation @ added.position
        return type(place)(place.body, place.joint, np.concatenate(there), place.hidden)

    def __iter__(self) -> Iterator[int]:
        yield from self._own
        yield from self._added

    def __len__(self) -> int:
        return len(self._own) + len(self._added)


def as_placement(value: ArrayLike, what: str) -> tuple[np.ndarray, np.ndarray]:
    """Read where a frame is on another.

    Args:
        value: (3,) position, m; (7,) position and quaternion [x y z, qw qx qy qz]; or a (4, 4)
            homogeneous matrix.
        what: What it is, for errors.

    Returns:
        Rotation (3, 3) and position (3,), m.

    Raises:
        InputError: None of these forms, not finite, or no rotation.
    """
    given = as_numbers(value, what, (3,), (7,), (4, 4))
    if given.shape == (3,):
        return np.eye(3), given
    if given.shape == (7,):
        w, *xyz = given[3:]
        length = float(np.linalg.norm(given[3:]))
        if abs(length - 1.0) > ORTHONORMAL:
            raise InputError(f"{what}: the quaternion qw qx qy qz has length {length:g}, not 1")
        K = skew(np.array(xyz) / length)
        return np.eye(3) + 2.0 * (w / length) * K + 2.0 * K @ K, given[:3]
    R = given[:3, :3]
    proper = np.abs(R @ R.T - np.eye(3)).max() <= ORTHONORMAL and np.linalg.det(R) > 0.0
    if not proper or not np.array_equal(given[3], (0.0, 0.0, 0.0, 1.0)):
        raise InputError(f"{what} must be a rotation and a position with the last row 0 0 0 1")
    u, _, vt = np.linalg.svd(R)
    return u @ vt, given[:3, 3]


def as_numbers(value: ArrayLike, what: str, *shapes: tuple[int, ...]) -> np.ndarray:
    """Read finite numbers of one of some shapes.

    Raises:
        InputError: They are not.
    """
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        found = np.full(1, np.nan)
    if found.shape not in shapes or not np.isfinite(found).all():
        forms = " or ".join("one number" if not s else f"of shape {s}" for s in shapes)
        raise InputError(f"{what} must be finite, {forms}, got {value!r}")
    found.setflags(write=False)
    return found


def skew(a: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3) of the product a × b."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
