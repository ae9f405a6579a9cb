"""What a scenario file can say about what is fixed to the robot: frames of one's own, and a load."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field

from opspace.robots.payload import Payload
from opspace.scenario.fields import Checked, Entry, Number, problem, shown
from opspace.scenario.targets import QUATERNION_TOLERANCE


def _placement(value: Any) -> tuple[float, ...]:
    """Read a position, or a position and a quaternion, which is made exact."""
    if not isinstance(value, list | tuple) or len(value) not in (3, 7):
        raise problem(f"must be [x, y, z] or [x, y, z, qw, qx, qy, qz] [m], not {shown(value)}")
    found = Number("1", size="any").check(value)
    assert isinstance(found, tuple)
    norm = math.hypot(*found[3:])
    if len(found) == 7 and abs(norm - 1.0) > QUATERNION_TOLERANCE:
        raise problem(f"must end with a quaternion w x y z of norm 1, not {norm:.6g}")
    return (*found[:3], *(number / norm for number in found[3:]))


def _inertia(value: Any) -> tuple[Any, ...] | None:
    """Read three moments, or the matrix row by row."""
    if value is None:
        return None
    row = Number("kg·m²", size=3)
    if isinstance(value, list | tuple) and len(value) == 3 and isinstance(value[0], list | tuple):
        return tuple(row.check(one) for one in value)
    found = row.check(value)
    assert isinstance(found, tuple)
    return found


class FrameEntry(Entry):
    """A frame of one's own on the robot."""

    parent: str | None = Field(
        default=None, description="frame that it is fixed to; null is the robot's tool"
    )
    placement: Annotated[Any, Checked(_placement)] = Field(
        default=(0.0, 0.0, 0.0),
        description="where it is there: [x, y, z] or [x, y, z, qw, qx, qy, qz] [m]",
    )


class PayloadEntry(Entry):
    """What the robot carries, in the controller's model as in the simulation."""

    mass: Annotated[float, Number("kg", at_least=0.0)] = Field(description="mass [kg]")
    centre: Annotated[tuple[float, ...], Number("m", size=3)] = Field(
        default=(0.0, 0.0, 0.0), description="centre of mass in the frame's axes [m]"
    )
    inertia: Annotated[Any, Checked(_inertia)] = Field(
        default=None,
        description="about the centre, three moments or the matrix [kg·m²]; null is a point",
    )
    frame: str | None = Field(
        default=None, description="name of the frame that carries it; null is the robot's tool"
    )

    def build(self) -> Payload:
        """Make the payload.

        Raises:
            InputError: No body has such an inertia.
        """
        return Payload(self.mass, self.centre, self.inertia, self.frame)
