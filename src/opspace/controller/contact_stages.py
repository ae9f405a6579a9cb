"""The stages of a robot that stands: what it touches, and a motion with the forces for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from opspace.command import ContactStatus, Status
from opspace.contacts import ContactTerms
from opspace.controller.bounds import NOTHING, Bounds, Kept, acting
from opspace.controller.collisions import DistanceTerms
from opspace.controller.limit_task_sets import TOP, LimitTerms
from opspace.law import TaskSet, corners
from opspace.law.contact_forces import (
    NORMAL,
    ForceSet,
    Realised,
    Room,
    Wish,
    free_motions,
    share,
)
from opspace.law.scalars import (
    BARELY,
    FALLING,
    LEVER,
    MAY_GIVE_UP,
    NOTICED,
    entering_weight,
)
from opspace.stack import ContactMember
from opspace.tasks.activations import checked_activation

if TYPE_CHECKING:
    from opspace.controller.stages import Given

GROUND = TOP - 1
"""Priority of contacts: above joint limits, for they are physics."""
NEVER_SINGULAR = 1e-12
"""Reference of σ for contacts: no buffer fades what the ground holds."""


class Footing(NamedTuple):
    """A contact in one tick.

    Attributes:
        member: The contact in its stack.
        terms: Its Jacobian and what it asks for.
        motion: h_m.
        force: h_f.
    """

    member: ContactMember
    terms: ContactTerms
    motion: float
    force: float


def evaluate_contacts(k: Given) -> list[Footing]:
    """J, γ, h_m and h_f of every contact."""
    found: list[Footing] = []
    for member in k.contacts:
        contact = member.contact
        own = checked_activation(f"contact {contact.name!r}", contact.activation, k.robot, k.t)
        found.append(Footing(member, contact.evaluate(k.robot), *member.activations(own)))
    return found


def contact_task_sets(touches: Sequence[Footing]) -> list[TaskSet]:
    """J q̈ = γ of the contacts whose motion is there, above everything."""
    return [
        TaskSet(
            touch.terms.J,
            touch.terms.acceleration,
            GROUND,
            touch.motion,
            touch.member.contact.name,
            NEVER_SINGULAR,
        )
        for touch in touches
        if touch.motion > 0.0
    ]


def stand(
    k: Given,
    L: np.ndarray,
    limits: Sequence[LimitTerms],
    touches: Sequence[Footing],
    distances: DistanceTerms | None,
    W: np.ndarray,
    gamma: np.ndarray,
) -> Kept:
    """Share the forces for what the law wants, and take the nearest motion that forces allow.

    Args:
        k: What the tick began with.
        L: (n, n) Cholesky factor of the inertia.
        limits: Joint limits.
        touches: The contacts.
        distances: Distances that may shrink only so fast; None for none.
        W: (n, n) metric of the tasks.
        gamma: (n,) M q̈* of the law, N·m.

    Returns:
        Torque, motion and forces.
    """
    rules, base = k.rules, k.base
    sets = [touch.member.contact.force_set(touch.terms, touch.force) for touch in touches]
    carrying = [one for one in sets if one.activation > 0.0]
    blend = corners([one.activation for one in carrying], "idv")
    wanted = share(carrying, (gamma + k.bias)[:base], blend)
    held = [np.zeros((0, k.v.size)), *(t.terms.J for t in touches if t.motion == 1.0)]
    free = free_motions(np.concatenate(held), L)
    wish = Wish(
        L, k.bias, np.linalg.solve(k.M, gamma), wanted, W + entering(touches, L), free, base
    )
    keeps = limits if rules.limits is not None and rules.limits.law.bound else []
    room = k.torque_limit if rules.keep_torque else np.full(k.v.size, np.inf)
    bounds = Bounds(keeps, k.M, k.bias, room, distances)
    apart = (np.zeros((0, k.v.size)), NOTHING, NOTHING)
    if distances is not None:
        apart = (distances.G, distances.most, distances.softness(k.M))
    found = rules.realise(wish, carrying, Room(bounds.lower, bounds.upper, room, *apart))
    if rules.observer is not None:
        rules.observer.remember(k.t, k.v, found.acceleration)
    weight = float(np.linalg.norm(k.robot.gravity[:3]))
    lost = _size(found.given_up) / max(weight, np.finfo(float).tiny)
    status = _status(found, lost, touches)
    if bounds.lost(found.acceleration):
        status |= Status.LIMIT_LOST
    if np.any(found.rows > 0.0):
        status |= Status.COLLISION
    if found.projected and bounds.will_close(found.acceleration):
        status |= Status.COLLISION_LOST
    names = acting(bounds.terms, found.upper, found.lower)
    told = _told(touches, sets, found.forces)
    return Kept(found.tau, status, names, found.rows, told, lost / MAY_GIVE_UP)


def entering(touches: Sequence[Footing], L: np.ndarray) -> np.ndarray:
    """Hold contacts on their way in the metric, the harder the nearer they are to closed."""
    W = np.zeros(L.shape)
    for touch in touches:
        h = touch.motion
        if 0.0 < h < 1.0:
            J = np.linalg.solve(L, touch.terms.J.T).T
            W += entering_weight(h) * (J.T @ J)
    return W


def _size(wrench: np.ndarray) -> float:
    """Size of a wrench as a force, N."""
    return max(float(np.linalg.norm(wrench[:3])), float(np.linalg.norm(wrench[3:])) / LEVER)


def _status(found: Realised, lost: float, touches: Sequence[Footing]) -> Status:
    status = Status.OK
    if found.projected:
        status |= Status.FILTERED
    if found.motors:
        status |= Status.TORQUE_SCALED
    if lost > NOTICED:
        status |= Status.GIVEN_UP
    if lost > FALLING:
        status |= Status.NOT_BALANCED
    if any(touch.member.waiting for touch in touches):
        status |= Status.CONTACT_WAITS
    return status


def _told(
    touches: Sequence[Footing], sets: Sequence[ForceSet], forces: Sequence[np.ndarray]
) -> dict[str, ContactStatus]:
    """Tell about every contact, those that carry nothing included."""
    left = iter(forces)
    return {
        touch.member.contact.name: contact_status(
            touch, one, next(left) if one.activation > 0.0 else np.zeros(one.metric.size)
        )
        for touch, one in zip(touches, sets, strict=True)
    }


def contact_status(touch: Footing, one: ForceSet, force: np.ndarray) -> ContactStatus:
    """Tell about one contact."""
    pressed, axes = float(force[NORMAL]), touch.terms.axes
    moment = touch.member.contact.wrench(force)[3:]
    cop, use = np.zeros(2), 0.0
    if pressed > BARELY * touch.member.contact.max_force:
        edge = -one.cone[:, NORMAL] * pressed
        use = float(np.max(1.0 + (one.cone @ force) / edge))
        if np.any(moment):
            cop = np.array([-moment[1], moment[0]]) / pressed
    member = touch.member
    return ContactStatus(
        member.progress,
        touch.motion,
        touch.force,
        axes @ force[:3],
        axes @ moment,
        cop,
        use,
        member.waiting,
    )
