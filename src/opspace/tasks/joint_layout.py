"""Which velocity coordinates and configuration entries belong to a choice of joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from opspace.errors import InputError, unknown_name
from opspace.tasks.rotation import ORTHONORMAL_TOLERANCE
from opspace.tasks.validation import Array

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


@dataclass(frozen=True)
class Layout:
    """A choice of joints in the coordinates of a robot.

    Attributes:
        coordinates: (m,) indices of the joints in v.
        entries: Indices of the same joints in q.
        quaternions: For each quaternion among them, where it starts within ``entries``.
        nq: Number of entries of the whole configuration.
        J: (m, n) selected rows of the identity, read-only.
        drift: (m,) zeros, read-only.
        names: (m,) names of the coordinates.
        units: (m,) "rad" or "m".
        endless: (m,) whether the joint turns without end, so that whole turns make no difference.
    """

    coordinates: np.ndarray
    entries: np.ndarray
    quaternions: tuple[int, ...]
    nq: int
    J: Array
    drift: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    endless: np.ndarray

    def select(self, values: Array, what: str) -> Array:
        """Return the entries of the chosen joints, quaternions normalised.

        Args:
            values: Whole configuration (nq,) or the entries of the chosen joints alone.
            what: What the values are, at the start of the error message.

        Returns:
            The entries, read-only.

        Raises:
            InputError: Another length, or a quaternion that is not of norm 1.
        """
        if values.size == self.nq:
            chosen = values[self.entries]
        elif values.size == len(self.entries):
            chosen = values.copy()
        else:
            raise InputError(
                f"{what} must be the whole configuration ({self.nq} numbers) or one number for "
                f"each of {', '.join(self.names)}, not {values.size} numbers"
            )
        for start in self.quaternions:
            part = chosen[start : start + 4]
            norm = math.sqrt(part @ part)
            if abs(norm - 1.0) > ORTHONORMAL_TOLERANCE:
                raise InputError(f"{what} contains a quaternion (wxyz) of norm {norm:.6g}, not 1")
            part /= norm
        chosen.flags.writeable = False
        return chosen


def joint_layout(robot: Robot, joints: Sequence[str] | None) -> Layout:
    """Find joints by name.

    Args:
        robot: The robot.
        joints: Names of coordinates, or of joints with several coordinates; None is every
            actuated coordinate.

    Returns:
        The layout, coordinates in the order of v, or in the order given.

    Raises:
        UnknownNameError: A joint that the robot does not have.
        InputError: A joint named twice, or no joint at all.
    """
    coordinates = _chosen(robot, joints)
    places = configuration_places(robot)
    entries: list[int] = []
    quaternions: list[int] = []
    for i in coordinates:
        if places[i][0] in entries:  # another coordinate of a joint already listed
            continue
        if len(places[i]) == 4:
            quaternions.append(len(entries))
        entries += places[i]
    J = np.eye(robot.nv)[coordinates]
    drift = np.zeros(len(coordinates))
    J.flags.writeable = drift.flags.writeable = False
    from opspace.robots.joint_units import joint_units  # noqa: PLC0415 - a package slow to import

    units = joint_units(robot)
    return Layout(
        coordinates=np.array(coordinates),
        entries=np.array(entries),
        quaternions=tuple(quaternions),
        nq=robot.nq,
        J=J,
        drift=drift,
        names=tuple(robot.joint_names[i] for i in coordinates),
        units=tuple(units[i] for i in coordinates),
        endless=np.isin(coordinates, endless_joints(robot, places)),
    )


def configuration_places(robot: Robot) -> list[tuple[int, ...]]:
    """Find the entries of q that each velocity coordinate moves.

    They are found by moving one coordinate at a time, which holds for any joint: one entry for a
    joint of one degree of freedom, the same four for the three coordinates of a quaternion.

    Args:
        robot: The robot.

    Returns:
        For each coordinate of v the entries of q, in rising order.
    """
    q = robot.q_reference
    moved = [
        set(np.flatnonzero(robot.integrate(q, direction, 0.1) != q).tolist())
        for direction in np.eye(robot.nv)
    ]
    # Turning a quaternion about one axis may leave an entry as it was, so that coordinates that
    # share an entry share all of theirs.
    whole = [set().union(*(other for other in moved if other & own)) for own in moved]
    return [tuple(sorted(entries)) for entries in whole]


def endless_joints(robot: Robot, places: Sequence[tuple[int, ...]]) -> list[int]:
    """Find the joints without limits that a full turn brings back to where they were.

    They are found by turning them, which tells a hinge from a slide and from one that others follow
    at half its rate.

    Args:
        robot: The robot; its state is not touched.
        places: What `configuration_places` gives.

    Returns:
        Indices in v.
    """
    unlimited = np.isneginf(robot.q_lower) & np.isposinf(robot.q_upper)
    candidates = [i for i in np.flatnonzero(unlimited).tolist() if len(places[i]) == 1]
    if not candidates:
        return []
    moved = robot.fresh()
    before = _where(moved, robot.q_reference)
    found: list[int] = []
    for i in candidates:
        q = robot.q_reference.copy()
        q[places[i][0]] += 2.0 * math.pi
        if np.allclose(_where(moved, q), before, rtol=0.0, atol=1e-9):
            found.append(i)
    return found


def _where(robot: Robot, q: Array) -> Array:
    """Return the place of every frame, and of the centre of mass, in one array."""
    robot.update(q, np.zeros(robot.nv))
    frames = range(len(robot.frame_names))
    places = [robot.com_position(), *(robot.position(f) for f in frames)]
    return np.concatenate([*places, *(robot.rotation(f).ravel() for f in frames)])


def _chosen(robot: Robot, joints: Sequence[str] | None) -> list[int]:
    if joints is None:
        chosen = [int(i) for i in np.flatnonzero(robot.actuated)]
    else:
        chosen = [i for name in joints for i in _coordinates(robot, name)]
    for i in chosen:
        if chosen.count(i) > 1:
            raise InputError(f"joint {robot.joint_names[i]!r} is listed twice")
    if not chosen:
        raise InputError(f"robot {robot.name!r} has no actuated joint")
    return chosen


def _coordinates(robot: Robot, name: str) -> list[int]:
    found = [i for i, known in enumerate(robot.joint_names) if _belongs(known, name)]
    if not found:
        raise unknown_name(f"joint of {robot.name}", name, robot.joint_names)
    return found


def _belongs(coordinate: str, joint: str) -> bool:
    """Whether a coordinate is the joint of this name or one of its "joint/0", "joint/1", ..."""
    prefix, _, number = coordinate.rpartition("/")
    return coordinate == joint or (prefix == joint and number.isdigit())
