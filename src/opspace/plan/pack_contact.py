"""An activation by contact, apart from what only Python can evaluate of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

from opspace.robots.protocol import Robot
from opspace.tasks.activations import ActivationProduct, ActivationUnion
from opspace.tasks.contact import Contact

Activation = Callable[[Robot, float], float]


class Activated(NamedTuple):
    """Where a task takes its activation from.

    Attributes:
        touch: What ``TOUCH`` of `opspace.kernels.columns` has: which contact, and how it counts.
        called: What is left to be called in Python; None is nothing.
    """

    touch: int
    called: Activation | None


def activated(activation: Activation | None, presses: Mapping[int, int]) -> Activated:
    """Take a contact out of an activation.

    Args:
        activation: The activation of a task.
        presses: Rows of the force tasks that compiled code evaluates, by identity.
    """
    parts, either = _parts(activation)
    contacts = [
        part
        for part in parts
        if isinstance(part, Contact) and type(part) is Contact and id(part.task) in presses
    ]
    if len(contacts) != 1:
        return Activated(0, activation)
    touch = presses[id(contacts[0].task)] + 1
    rest = [part for part in parts if part is not contacts[0]]
    if not rest:
        return Activated(touch, None)
    if either:
        return Activated(-touch, ActivationUnion(*rest))
    return Activated(touch, ActivationProduct(*rest))


def _parts(activation: Activation | None) -> tuple[tuple[Activation, ...], bool]:
    """Return what an activation consists of, and whether any of it is enough."""
    if isinstance(activation, ActivationUnion) and type(activation) is ActivationUnion:
        return activation.parts, True
    if isinstance(activation, ActivationProduct) and type(activation) is ActivationProduct:
        return activation.factors, False
    return (() if activation is None else (activation,)), False
