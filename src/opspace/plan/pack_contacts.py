"""The contacts of a stack as rows of numbers, those that are there at a tick."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from opspace.command import ContactStatus
from opspace.contacts import (
    EdgeContact,
    GroundContact,
    PointContact,
    SoleContact,
    SurfaceContact,
)
from opspace.kernels.columns import LOCAL, OFFSET
from opspace.kernels.stance_columns import NORMAL, SURFACE
from opspace.plan.contact_records import make_stance
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.protocol import Robot
from opspace.stack import ContactMember
from opspace.tasks.activations import checked_activation

PACKED = (SoleContact, EdgeContact, PointContact)
"""Contacts that compiled code evaluates, by exact type."""


class ContactTick(NamedTuple):
    """A contact at one tick, as its report needs it."""

    contact: GroundContact
    progress: float
    motion: float
    force: float
    waiting: bool

    def status(self, force: np.ndarray, axes: np.ndarray, use: float) -> ContactStatus:
        """Tell about it.

        Args:
            force: (6,) planned force in its own axes, N and N·m.
            axes: (9,) its axes in the world, by rows.
            use: Part of its cone that this uses.
        """
        R = axes.reshape(3, 3)
        pressed = use != 0.0 and bool(np.any(force[3:]))
        return ContactStatus(
            self.progress,
            self.motion,
            self.force,
            R @ force[:3],
            R @ force[3:],
            np.array([-force[4], force[3]]) / force[NORMAL] if pressed else np.zeros(2),
            use,
            self.waiting,
        )


def fits(members: Sequence[ContactMember]) -> bool:
    """Tell whether compiled code can evaluate all of these contacts."""
    return all(type(member.contact) in PACKED for member in members)


class PackedContacts:
    """The contacts of one robot in the arrays of a tick.

    Args:
        axes: The robot's arrays.
        most: Contacts that can be there at once.
        room: (n,) what the motors give where they are asked, N·m.
        distances: Distances that can be kept at once.

    Attributes:
        most: The same.
        distances: The same.
        record: The arrays, `STANCE`.
        footing: The contacts of the last tick.
    """

    def __init__(self, axes: MotionAxes, most: int, room: np.ndarray, distances: int = 0) -> None:
        self.most, self.distances = most, distances
        self.record = make_stance(axes.v.size, most, room, distances)
        self.footing: tuple[ContactTick, ...] = ()
        self._axes = axes
        self._there: list[tuple[object, ...]] = []
        self._motion, self._force = self.record.motion.data, self.record.force.data
        self._hindrance = self.record.hindrance.data

    @property
    def hindrance(self) -> float:
        """What the last tick gave up, see `opspace.stack.ContactMember.advance`."""
        return self._hindrance[0]

    def begin(self, members: Sequence[ContactMember], robot: Robot, t: float) -> bool:
        """Take over the contacts at time ``t`` [s].

        Args:
            members: Those that are there, no more than ``most``, all of which fit.
            robot: The robot, whose state activations of their own may ask for.
            t: Time, s.

        Returns:
            Whether one of them waits.

        Raises:
            InputError: An activation gave an unusable number.
        """
        there = [_known(member.contact) for member in members]
        if there != self._there:
            self._pack([member.contact for member in members])
            self._there = there
        found: list[ContactTick] = []
        waits = False
        for i, member in enumerate(members):
            contact, own = member.contact, 1.0
            if contact.activation is not None:
                what = f"contact {contact.name!r}"
                own = checked_activation(what, contact.activation, robot, t)
            motion, force = member.activations(own)
            self._motion[i], self._force[i] = motion, force
            waits |= member.waiting
            found.append(ContactTick(contact, member.progress, motion, force, member.waiting))
        self.footing = tuple(found)
        return waits

    def _pack(self, contacts: Sequence[GroundContact]) -> None:
        stance, first = self.record, 0
        for i, contact in enumerate(contacts):
            place, rows, cone = self._axes.frames[contact.frame_id], contact.rows, contact.cone()
            stance.place[i] = place.body, place.joint, rows, first
            stance.numbers[i, LOCAL : LOCAL + 12] = place.local
            stance.numbers[i, OFFSET : OFFSET + 3] = contact.offset
            if isinstance(contact, SurfaceContact):
                surface = contact.surface.copy()
                if isinstance(contact, EdgeContact):
                    surface[:, :NORMAL] = np.stack([contact.along, np.zeros(3)], axis=1)
                stance.numbers[i, SURFACE : SURFACE + 9] = surface.ravel()
            stance.most[i], stance.edges[i] = contact.max_force, len(cone)
            stance.cone[i] = 0.0
            stance.cone[i, : len(cone), :rows] = cone
            own = slice(first, first + rows)
            stance.metric[own], stance.reference[own] = contact.shares()
            first += rows
        stance.count[0], stance.rows[0] = len(contacts), first


def _known(contact: GroundContact) -> tuple[object, ...]:
    """Collect what is packed of a contact."""
    half = contact.half if isinstance(contact, SoleContact | EdgeContact) else None
    force = contact.force
    return (
        id(contact),
        contact.frame_id,
        contact.friction,
        half,
        contact.max_force,
        contact.offset.tobytes(),
        None if force is None else force.tobytes(),
    )
