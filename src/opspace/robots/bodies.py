"""A robot as a tree of rigid bodies in numbers, and the memory for its dynamics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# Kinds of joints; the first two turn about an axis of the joint, or about any.
ALIGNED, HINGE, SLIDE, TRANSLATION, BALL = range(5)


class RigidBodies(NamedTuple):
    """A tree of bodies as numbers, each behind one joint; body 0 is the world and has none.

    Attributes:
        kind: (bodies,) kind of the joint.
        parent: (bodies,) the body that carries the joint; it comes before.
        place: (bodies, 12) the joint on its parent: rotation by columns, then position, m.
        axis: (bodies, 3) axis of a hinge or slide, of unit length.
        along: (bodies,) which axis of the joint an aligned hinge turns about.
        first_q: (bodies,) first coordinate in q.
        first_v: (bodies,) first coordinate in v.
        width: (bodies,) coordinates in v.
        mass: (bodies,) kg.
        centre: (bodies, 3) centre of mass on the body, m.
        tensor: (bodies, 6) rotational inertia about it in the axes of the body, xx, xy, yy, xz, yz,
            zz, kg·m².
        before: (n,) the velocity coordinate before each one on the way to the base, −1 for none.
        armature: (n,) inertia of the motors at the joints, kg·m² or kg.
        gravity: (3,) m/s².
    """

    kind: np.ndarray
    parent: np.ndarray
    place: np.ndarray
    axis: np.ndarray
    along: np.ndarray
    first_q: np.ndarray
    first_v: np.ndarray
    width: np.ndarray
    mass: np.ndarray
    centre: np.ndarray
    tensor: np.ndarray
    before: np.ndarray
    armature: np.ndarray
    gravity: np.ndarray


class Dynamics(NamedTuple):
    """What `evaluate` finds at one state, and the memory that it works in.

    Attributes:
        M: (n, n) joint-space inertia, armature included.
        bias: (n,) b + g, N·m.
        axes: (n, 6) motion that one unit of each velocity coordinate gives to a body.
        placement: (bodies, 12) rotation by columns, then position, m.
        velocity: (bodies, 6) motion of each body.
        acceleration: (bodies, 6) its rate at zero joint acceleration, gravity subtracted.
        force: (bodies, 6) force and moment about the origin that this takes.
        inertia: (bodies, 10) inertia of each body, in the end of all that it carries.
        step: (bodies, 6) motion of each body on its parent, S v.
    """

    M: np.ndarray
    bias: np.ndarray
    axes: np.ndarray
    placement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    force: np.ndarray
    inertia: np.ndarray
    step: np.ndarray


def no_bodies() -> RigidBodies:
    """Give a tree without bodies, of a robot that somebody else computes."""
    numbers, integers = np.zeros(0), np.zeros(0, np.int64)
    table = np.zeros((0, 12))
    return RigidBodies(
        kind=integers,
        parent=integers,
        place=table,
        axis=table[:, :3].copy(),
        along=integers,
        first_q=integers,
        first_v=integers,
        width=integers,
        mass=numbers,
        centre=table[:, :3].copy(),
        tensor=table[:, :6].copy(),
        before=integers,
        armature=numbers,
        gravity=np.zeros(3),
    )


def make_dynamics(bodies: RigidBodies) -> Dynamics:
    """Make the memory for the dynamics of a tree."""
    n, count = bodies.before.size, bodies.kind.size
    placement = np.zeros((count, 12))
    placement[:1, [0, 4, 8]] = 1.0
    return Dynamics(
        M=np.zeros((n, n)),
        bias=np.zeros(n),
        axes=np.zeros((n, 6)),
        placement=placement,
        velocity=np.zeros((count, 6)),
        acceleration=np.zeros((count, 6)),
        force=np.zeros((count, 6)),
        inertia=np.zeros((count, 10)),
        step=np.zeros((count, 6)),
    )
