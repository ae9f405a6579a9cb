"""What a simulated robot stands on, and what it feels of it."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from opspace.contacts import EdgeContact, GroundContact, SoleContact
from opspace.errors import InputError, unknown_name
from opspace.sim.held_load import place_of

RADIUS = 0.005
"""Of the balls that touch, m."""
STICKING = 100.0
"""How much harder friction is than pressure: soft contacts creep under a load."""
PREFIX, PLANES, FLOOR = "opspace_touch", "opspace_plane", "floor"
EVERY = 2**30 - 1
"""Whatever touches may touch it."""


@dataclass(frozen=True)
class Wall:
    """A plane that robots may touch.

    Attributes:
        point: (3,) a point of it, m.
        normal: (3,) out of the wall.
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]


@dataclass(frozen=True)
class Board:
    """The floor below one contact, which has another height from some time on.

    It should come while the contact is in the air: below a foot that stands it is a blow.

    Attributes:
        contact: Name of the contact.
        height: How much higher than the floor, m; below 0 is a hole.
        at: When it comes, s.
    """

    contact: str
    height: float
    at: float = 0.0


@dataclass(frozen=True)
class Ground:
    """A floor, perhaps walls, and what of the robot touches them.

    A sole touches with small balls at its four corners, an edge with two at its ends, a point with one;
    nothing else touches anything, whatever shapes the robot's file has.

    Attributes:
        contacts: What touches, whether a stack has it or not.
        height: Of the floor, m.
        friction: Real coefficient of friction.
        time_constant: Of the surfaces' give, s.
        walls: Other planes.
        boards: Where the floor changes its height.

    Raises:
        InputError: Nothing touches, or a number that cannot be used.
        UnknownNameError: A board below a contact that there is not.
    """

    contacts: Sequence[GroundContact]
    height: float = 0.0
    friction: float = 0.8
    time_constant: float = 0.01
    walls: Sequence[Wall] = ()
    boards: Sequence[Board] = ()

    def __post_init__(self) -> None:
        if not self.contacts:
            raise InputError("ground needs contacts: nothing else of a robot touches it")
        for what in ("friction", "time_constant"):
            value = getattr(self, what)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"ground: {what} must be above 0, got {value}")
        names = [contact.name for contact in self.contacts]
        for board in self.boards:
            if board.contact not in names:
                raise unknown_name("contact of the ground", board.contact, names)
            if not (math.isfinite(board.height) and math.isfinite(board.at)):
                raise InputError(f"a board needs a height and a time that are finite, got {board}")

    def add_to(self, spec: Any) -> None:
        """Add planes and balls to a MuJoCo specification.

        Raises:
            InputError: The robot has no body or site with the name of a contact's frame.
        """
        import mujoco  # noqa: PLC0415 - an extra, and slow to import

        touching: dict[str, Any] = {
            "mass": 0.0,
            "condim": 3,
            "friction": [self.friction, 0.0, 0.0],
            "solref": [self.time_constant, 1.0],
            "group": 3,
        }
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 0
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        if self.boards:
            # Boxes around the shapes of a body are made once; a board that moves leaves its own.
            spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
        spec.option.impratio = STICKING
        own = self._own_floors()
        floor = Wall((0.0, 0.0, self.height), (0.0, 0.0, 1.0))
        planes = [(FLOOR, 1, floor), *((f"wall{i}", EVERY, w) for i, w in enumerate(self.walls))]
        planes += [(f"{FLOOR}/{name}", bit, floor) for name, bit in own.items()]
        for name, touched_by, wall in planes:
            quat = np.zeros(4)
            mujoco.mju_quatZ2Vec(quat, np.array(wall.normal) / np.linalg.norm(wall.normal))
            spec.worldbody.add_geom(
                name=f"{PLANES}/{name}",
                contype=touched_by & 1,
                conaffinity=touched_by,
                type=mujoco.mjtGeom.mjGEOM_PLANE,
                size=[0.0, 0.0, 0.05],
                pos=wall.point,
                quat=quat,
                rgba=[0.0, 0.0, 0.0, 0.0],
                **touching,
            )
        for contact in self.contacts:
            body, rotation, origin = _body(spec, contact)
            bit = own.get(contact.name, 1)
            for i, corner in enumerate(corners(contact)):
                body.add_geom(
                    name=f"{PREFIX}/{contact.name}/{i}",
                    contype=bit,
                    conaffinity=bit & 1,
                    type=mujoco.mjtGeom.mjGEOM_SPHERE,
                    size=[RADIUS, 0.0, 0.0],
                    pos=origin + rotation @ corner,
                    rgba=[0.2, 0.36, 0.58, 1.0],
                    **touching,
                )

    def _own_floors(self) -> dict[str, int]:
        """Give every contact with boards a bit, with which it meets a floor of its own."""
        names = dict.fromkeys(board.contact for board in self.boards)
        return {name: 2 << i for i, name in enumerate(names)}

    def lay_boards(self, model: Any, t: float) -> None:
        """Put the boards that have come by time ``t`` [s] where they belong."""
        for board in sorted(self.boards, key=lambda one: one.at):
            if board.at <= t:
                plane = model.geom(f"{PLANES}/{FLOOR}/{board.contact}").id
                model.geom_pos[plane, 2] = self.height + board.height
                # The shortcut for shapes that are where their body is, as this one was.
                model.geom_sameframe[plane] = 0

    def forces(self, model: Any, data: Any) -> dict[str, np.ndarray]:
        """Measure what presses on each contact, (3,) N in world axes."""
        import mujoco  # noqa: PLC0415 - an extra, and slow to import

        found = {contact.name: np.zeros(3) for contact in self.contacts}
        for i, touch in enumerate(data.contact[: data.ncon]):
            for sign, geom in ((-1.0, touch.geom1), (1.0, touch.geom2)):
                name = model.geom(int(geom)).name
                if name.startswith(PREFIX):
                    force = np.zeros(6)
                    mujoco.mj_contactForce(model, data, i, force)
                    axes = np.array(touch.frame).reshape(3, 3)
                    found[name.split("/", 1)[1].rsplit("/", 1)[0]] += sign * (axes.T @ force[:3])
        return found


def corners(contact: GroundContact) -> Iterator[np.ndarray]:
    """Give the middles of the balls with which a contact touches, (3,) in its frame."""
    if isinstance(contact, SoleContact):
        x, y = contact.half
        for a, b in product((1.0, -1.0), repeat=2):
            yield contact.offset + np.array([a * x, b * y, RADIUS])
    elif isinstance(contact, EdgeContact):
        for end in (contact.half, -contact.half):
            yield contact.offset + end * contact.along
    else:
        yield np.array(contact.offset)


def _body(spec: Any, contact: GroundContact) -> tuple[Any, np.ndarray, np.ndarray]:
    """Find the body of a frame, and where the frame is in it."""
    place = place_of(spec, contact.frame)
    if place is None:
        raise InputError(
            f"contact {contact.name!r}: the simulated robot has no body or site {contact.frame!r}"
        )
    return place
