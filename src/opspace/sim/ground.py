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

from opspace.contacts import GroundContact, SoleContact
from opspace.errors import InputError

RADIUS = 0.005
"""Of the balls that touch, m."""
STICKING = 100.0
"""How much harder friction is than pressure: soft contacts creep under a load."""
PREFIX = "opspace_touch"


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
class Ground:
    """A floor, perhaps walls, and what of the robot touches them.

    A sole touches with small balls at its four corners, a point with one; nothing else touches
    anything, whatever shapes the robot's file has.

    Attributes:
        contacts: What touches, whether a stack has it or not.
        height: Of the floor, m.
        friction: Real coefficient of friction.
        time_constant: Of the surfaces' give, s.
        walls: Other planes.

    Raises:
        InputError: Nothing touches, or a number that cannot be used.
    """

    contacts: Sequence[GroundContact]
    height: float = 0.0
    friction: float = 0.8
    time_constant: float = 0.01
    walls: Sequence[Wall] = ()

    def __post_init__(self) -> None:
        if not self.contacts:
            raise InputError("ground needs contacts: nothing else of a robot touches it")
        for what in ("friction", "time_constant"):
            value = getattr(self, what)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"ground: {what} must be above 0, got {value}")

    def add_to(self, spec: Any) -> None:
        """Add planes and balls to a MuJoCo specification.

        Raises:
            InputError: The robot has no body or site with the name of a contact's frame.
        """
        import mujoco  # noqa: PLC0415 - an extra, and slow to import

        touching: dict[str, Any] = {
            "mass": 0.0,
            "contype": 1,
            "conaffinity": 1,
            "condim": 3,
            "friction": [self.friction, 0.0, 0.0],
            "solref": [self.time_constant, 1.0],
            "group": 3,
        }
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 0
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = STICKING
        planes = [Wall((0.0, 0.0, self.height), (0.0, 0.0, 1.0)), *self.walls]
        for i, wall in enumerate(planes):
            quat = np.zeros(4)
            mujoco.mju_quatZ2Vec(quat, np.array(wall.normal) / np.linalg.norm(wall.normal))
            spec.worldbody.add_geom(
                name=f"{PREFIX}/plane{i}",
                type=mujoco.mjtGeom.mjGEOM_PLANE,
                size=[0.0, 0.0, 0.05],
                pos=wall.point,
                quat=quat,
                rgba=[0.0, 0.0, 0.0, 0.0],
                **touching,
            )
        for contact in self.contacts:
            body, rotation, origin = _body(spec, contact)
            for i, corner in enumerate(corners(contact)):
                body.add_geom(
                    name=f"{PREFIX}/{contact.name}/{i}",
                    type=mujoco.mjtGeom.mjGEOM_SPHERE,
                    size=[RADIUS, 0.0, 0.0],
                    pos=origin + rotation @ corner,
                    rgba=[0.2, 0.36, 0.58, 1.0],
                    **touching,
                )

    def forces(self, model: Any, data: Any) -> dict[str, np.ndarray]:
        """Measure what presses on each contact, (3,) N in world axes."""
        import mujoco  # noqa: PLC0415 - an extra, and slow to import

        found = {contact.name: np.zeros(3) for contact in self.contacts}
        for i, touch in enumerate(data.contact[: data.ncon]):
            for sign, geom in ((-1.0, touch.geom1), (1.0, touch.geom2)):
                name = model.geom(int(geom)).name
                if name.startswith(PREFIX) and "/plane" not in name:
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
    else:
        yield np.array(contact.offset)


def _body(spec: Any, contact: GroundContact) -> tuple[Any, np.ndarray, np.ndarray]:
    """Find the body of a frame, and where the frame is in it."""
    import mujoco  # noqa: PLC0415 - an extra, and slow to import

    body = spec.body(contact.frame)
    if body is not None:
        return body, np.eye(3), np.zeros(3)
    site = spec.site(contact.frame)
    if site is None:
        raise InputError(
            f"contact {contact.name!r}: the simulated robot has no body or site {contact.frame!r}"
        )
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, site.quat)
    return site.parent, matrix.reshape(3, 3), np.array(site.pos)
