"""Where motion is measured: a frame in the world, a frame seen from another, the centre of mass."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike

from opspace.tasks.rotation import cross, skew
from opspace.tasks.validation import Array, finite_array

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


@dataclass(frozen=True, slots=True)
class Motion:
    """Position, orientation and their rates at one state, rows linear then angular.

    Attributes:
        position: (3,) m.
        rotation: (3, 3) orientation.
        velocity: (6,) J v, m/s and rad/s.
        J: (6, n) Jacobian.
        drift: (6,) J̇ v, m/s² and rad/s².
    """

    position: Array
    rotation: Array
    velocity: Array
    J: Array
    drift: Array


class MotionSource(Protocol):
    """Something on a robot whose motion a task can control."""

    def bind(self, robot: Robot) -> None:
        """Look up names; raises UnknownNameError."""
        ...

    def measure(self, robot: Robot) -> Motion:
        """Return the motion at the robot's present state."""
        ...


@dataclass
class WorldFrame:
    """A point fixed in a frame, seen from the world, in world axes.

    With the offset o in the frame's axes and r = R o:
    x = p + r, ẋ = ṗ + ω × r, J̇v = p̈ + ω̇ × r + ω × (ω × r).

    Attributes:
        frame: Name of the frame; None is the robot's tool.
        offset: (3,) point in the frame's axes, m; None is the origin.
        id: Id of the frame once it is bound.
    """

    frame: str | None
    offset: Array | None = None
    id: int = field(default=-1, repr=False)

    def bind(self, robot: Robot) -> None:
        """Look up the frame."""
        self.id = robot.frame_id(robot.tool if self.frame is None else self.frame)

    def measure(self, robot: Robot) -> Motion:
        """Return the motion of the point."""
        id_ = self.id
        position, rotation = robot.position(id_), robot.rotation(id_)
        velocity, J, drift = robot.velocity(id_), robot.jacobian(id_), robot.drift(id_)
        if self.offset is None:
            return Motion(position, rotation, velocity, J, drift)
        r = rotation @ self.offset
        omega = velocity[3:]
        turning = cross(omega, r)
        shift = np.eye(6)
        shift[:3, 3:] = -skew(r)
        moved = shift @ drift
        moved[:3] += cross(omega, turning)
        return Motion(position + r, rotation, shift @ velocity, shift @ J, moved)


@dataclass
class RelativeFrame:
    """A frame seen from another frame, in the axes of that other frame.

    With d = p − p_r in world axes and R_r, ω_r of the reference frame:
    x = R_rᵀ d, ẋ = R_rᵀ (ḋ − ω_r × d), ẍ = R_rᵀ (d̈ − ω̇_r × d − 2 ω_r × ḋ + ω_r × (ω_r × d));
    R = R_rᵀ R_f, ω = R_rᵀ (ω_f − ω_r), ω̇ = R_rᵀ (ω̇_f − ω̇_r − ω_r × ω_f).

    Attributes:
        frame: Name of the frame; None is the robot's tool.
        reference_frame: Name of the frame it is seen from.
        ids: Ids of both frames once they are bound.
    """

    frame: str | None
    reference_frame: str
    ids: tuple[int, int] = field(default=(-1, -1), repr=False)

    def bind(self, robot: Robot) -> None:
        """Look up both frames."""
        frame = robot.tool if self.frame is None else self.frame
        self.ids = (robot.frame_id(frame), robot.frame_id(self.reference_frame))

    def measure(self, robot: Robot) -> Motion:
        """Return the motion of the frame relative to the reference frame."""
        frame, reference = self.ids
        Rt = robot.rotation(reference).T
        d = robot.position(frame) - robot.position(reference)
        v_f, v_r = robot.velocity(frame), robot.velocity(reference)
        omega_r = v_r[3:]
        # Column blocks act on [linear; angular]: what the reference frame's own motion takes away.
        take = np.eye(6)
        take[:3, 3:] = -skew(d)
        rates = v_f - take @ v_r
        drift = robot.drift(frame) - take @ robot.drift(reference)
        drift[:3] -= cross(omega_r, v_f[:3] - v_r[:3] + rates[:3])
        drift[3:] -= cross(omega_r, v_f[3:])
        turn = np.zeros((6, 6))
        turn[:3, :3] = turn[3:, 3:] = Rt
        return Motion(
            position=Rt @ d,
            rotation=Rt @ robot.rotation(frame),
            velocity=turn @ rates,
            J=turn @ (robot.jacobian(frame) - take @ robot.jacobian(reference)),
            drift=turn @ drift,
        )


class CenterOfMass:
    """The robot's centre of mass in world axes; it has no orientation."""

    def bind(self, robot: Robot) -> None:
        """Do nothing: there is no name to look up."""

    def measure(self, robot: Robot) -> Motion:
        """Return the motion of the centre of mass, linear rows only."""
        J = robot.com_jacobian()
        return Motion(robot.com_position(), np.eye(3), J @ robot.v, J, robot.com_drift())


def as_offset(offset: ArrayLike | None, name: str) -> Array | None:
    """Check a point in a frame's axes, (3,) m; None is the frame's origin."""
    return None if offset is None else finite_array(offset, (3,), f"task {name!r}: offset")
