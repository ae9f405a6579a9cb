"""A robot as a tree of rigid bodies in numbers, and the memory for its dynamics."""

from __future__ import annotations

from functools import partial

import numpy as np

from opspace.machine.field_table import Field, Record, RecordTable

_INT = np.int64
_fixed = partial(Field, writer="robot", lives="robot")
_found = partial(Field, writer="tick", lives="tick")

RIGID_BODIES = RecordTable(
    "RigidBodies",
    "A tree of bodies as numbers, each behind one joint; body 0 is the world and has none.",
    _fixed("kind", ("bodies",), "kind of the joint, see `opspace.robots.joint_kinds`", dtype=_INT),
    _fixed("parent", ("bodies",), "body that carries the joint; it comes before", dtype=_INT),
    _fixed("place", ("bodies", 12), "joint on its parent: rotation by columns, then position", "m"),
    _fixed("axis", ("bodies", 3), "axis of a hinge or slide, of unit length"),
    _fixed(
        "along", ("bodies",), "which axis of the joint an aligned hinge turns about", dtype=_INT
    ),
    _fixed("first_q", ("bodies",), "first coordinate in q", dtype=_INT),
    _fixed("first_v", ("bodies",), "first coordinate in v", dtype=_INT),
    _fixed("width", ("bodies",), "coordinates in v", dtype=_INT),
    _fixed("mass", ("bodies",), "mass", "kg"),
    _fixed("centre", ("bodies", 3), "centre of mass on the body", "m"),
    _fixed("tensor", ("bodies", 6), "inertia about it: xx, xy, yy, xz, yz, zz", "kg·m²"),
    _fixed("before", ("n",), "coordinate before each one, −1 for none", dtype=_INT),
    _fixed("armature", ("n",), "inertia of the motors at the joints", "kg·m², kg"),
    _fixed("gravity", (3,), "gravity", "m/s²"),
    _fixed("carried", ("bodies",), "mass whose weight is carried for the robot", "kg"),
    _fixed("carried_at", ("bodies", 3), "its centre on the body", "m"),
    _fixed("stiffness", ("n",), "of the springs at the joints", "N·m/rad, N/m"),
    _fixed("relaxed", ("n",), "where they pull nowhere", "rad, m"),
)

DYNAMICS = RecordTable(
    "Dynamics",
    "What `opspace.kernels.dynamics.evaluate` finds at one state, and the memory that it works in.",
    _found("M", ("n", "n"), "joint-space inertia, armature included", "kg·m²"),
    _found("bias", ("n",), "b + g, springs included", "N·m"),
    _found("axes", ("n", 6), "motion that one unit of each velocity coordinate gives to a body"),
    _found("placement", ("bodies", 12), "rotation by columns, then position", "m"),
    Field("velocity", ("bodies", 6), "motion of each body", "m/s, rad/s"),
    Field("acceleration", ("bodies", 6), "its rate at zero q̈, gravity subtracted", "m/s², rad/s²"),
    Field("force", ("bodies", 6), "force and moment about the origin that this takes", "N, N·m"),
    Field(
        "inertia", ("bodies", 10), "of each body, in the end of all that it carries", "kg, kg·m²"
    ),
    Field("step", ("bodies", 6), "motion of each body on its parent, S v", "m/s, rad/s"),
    Field("cosine", ("whole nq",), "of each coordinate as an angle"),
    Field("sine", ("whole nq",), "of each coordinate as an angle"),
)


def no_bodies() -> Record:
    """Give a tree without bodies, of a robot that somebody else computes."""
    return RIGID_BODIES.make({"bodies": 0, "n": 0})


def make_dynamics(bodies: Record, nq: int) -> Record:
    """Make the memory for the dynamics of a tree, whose configuration has so many coordinates."""
    dynamics = DYNAMICS.make({"n": bodies.before.size, "bodies": bodies.kind.size, "nq": nq})
    dynamics.placement[:1, [0, 4, 8]] = 1.0
    return dynamics
