"""Contacts in the rows of a recording: how far each has come, what it should carry and what it does."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from opspace.command import ContactStatus
from opspace.contacts import EdgeContact, GroundContact, SoleContact, SurfaceContact
from opspace.record.format import Column
from opspace.record.reader import Recording

GROUP = "contacts"
"""Group of the columns of contacts."""
Felt = Callable[[], Mapping[str, np.ndarray]]
"""Tells the measured force on each contact, (3,) N on the robot in world axes."""

_AXES = "xyz"
_SIZE = 12


def columns_of_contacts(contacts: Sequence[GroundContact], *, measured: bool) -> list[Column]:
    """List the columns of contacts; rows hold NaN while a contact is not in the stack.

    Args:
        contacts: The contacts.
        measured: Whether forces are measured.
    """
    columns: list[Column] = []
    for contact in contacts:
        where = f"{GROUP}/{contact.name}"
        columns += [
            Column(f"{where}/progress", "1", f"how far {contact.name} has come"),
            Column(f"{where}/motion", "1", "activation of its motion"),
            Column(f"{where}/activation", "1", "activation of its force"),
            *(Column(f"{where}/force/{a}", "N", f"planned force on the robot, {a}") for a in _AXES),
            *(Column(f"{where}/moment/r{a}", "N·m", f"planned moment, {a}") for a in _AXES),
            Column(f"{where}/cop/x", "m", "centre of pressure in its axes, x"),
            Column(f"{where}/cop/y", "m", "centre of pressure in its axes, y"),
            Column(f"{where}/cone_use", "1", "part of its cone that the force uses"),
        ]
        if measured:
            columns += [
                Column(f"{where}/measured/{a}", "N", f"measured force on the robot, {a}")
                for a in _AXES
            ]
    return columns


def row_of_contacts(
    contacts: Sequence[GroundContact],
    told: Mapping[str, ContactStatus],
    felt: Mapping[str, np.ndarray] | None,
) -> list[np.ndarray]:
    """Give the numbers of one tick for `columns_of_contacts`."""
    parts: list[np.ndarray] = []
    for contact in contacts:
        one = told.get(contact.name)
        parts.append(np.full(_SIZE, np.nan) if one is None else _numbers(one))
        if felt is not None:
            parts.append(felt.get(contact.name, np.full(3, np.nan)))
    return parts


def _numbers(one: ContactStatus) -> np.ndarray:
    return np.concatenate(
        [
            [one.progress, one.motion, one.activation],
            one.force,
            one.moment,
            one.cop,
            [one.cone_use],
        ]
    )


def contacts_in(recording: Recording) -> list[str]:
    """List the contacts of a recording."""
    found = recording.header.get(GROUP)
    return list(found) if isinstance(found, dict) else []


def felt_in(recording: Recording) -> list[dict[str, np.ndarray]]:
    """Read the measured forces of every tick back, by contact; nothing where none were."""
    names = [n for n in contacts_in(recording) if f"{GROUP}/{n}/measured/x" in recording]
    forces = {name: recording.group(f"{GROUP}/{name}/measured") for name in names}
    return [{name: rows[i] for name, rows in forces.items()} for i in range(len(recording))]


def subject_of_contact(contact: GroundContact) -> dict[str, Any]:
    """Describe a contact in JSON's own types."""
    return {
        "frame": contact.frame,
        "offset": contact.offset.tolist(),
        "friction": contact.friction,
        "half": _half(contact),
        "along": contact.along.tolist() if isinstance(contact, EdgeContact) else None,
        "normal": contact.normal.tolist() if isinstance(contact, SurfaceContact) else None,
    }


def _half(contact: GroundContact) -> list[float] | None:
    """Half of the sides along the contact's own x and y."""
    if isinstance(contact, SoleContact):
        return list(contact.half)
    return [contact.half, 0.0] if isinstance(contact, EdgeContact) else None
