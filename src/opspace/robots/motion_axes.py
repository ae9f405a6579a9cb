"""What compiled code reads of a robot: arrays that every update fills in place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from opspace.machine.field_table import Record
from opspace.robots.bodies import make_dynamics, no_bodies
from opspace.robots.payload import Masses


@dataclass(frozen=True)
class FramePlace:
    """Where a frame is fixed.

    Attributes:
        body: Row of ``MotionAxes.placement`` that carries it, −1 for the world.
        joint: Last joint (velocity coordinate) that moves it, −1 for none.
        local: (12,) its placement on the body: rotation by columns, then position, m.
        hidden: Whether a joint that follows another is on its way: then ``joint`` does not say how it
            moves.
    """

    body: int
    joint: int
    local: np.ndarray
    hidden: bool = False


@dataclass(frozen=True)
class MassPoint:
    """Mass of a moving link.

    Attributes:
        body: Row of ``MotionAxes.placement``.
        joint: Last joint that moves it.
        mass: kg.
        centre: (3,) centre of mass on the body, m.
    """

    body: int
    joint: int
    mass: float
    centre: np.ndarray


@dataclass(frozen=True)
class MotionAxes:
    """A robot whose joints all have one degree of freedom, as arrays.

    The arrays of the first group are overwritten by every update; whoever holds them sees the
    present state without asking.

    Attributes:
        q: (n,) configuration.
        v: (n,) velocity.
        M: (n, n) joint-space inertia.
        bias: (n,) b + g, N·m.
        axes: (n, 6) motion that one unit of each joint's velocity gives to a body at the origin of
            the world, linear then angular, in world axes.
        placement: (bodies, 12) rotation by columns, then position, m.
        parent: (n,) the joint before each joint on the way to the base, −1 for none.
        frames: Frames by id.
        masses: Mass of the moving links, with what they carry.
        bodies: `RIGID_BODIES` that compiled code computes the dynamics from; none where the
            robot's library does.
        dynamics: `DYNAMICS`, where it computes them.
        later: `DYNAMICS`, the same at another state.
        followers: Whether joints follow others; what they carry is in M and bias, not in ``masses``.
    """

    q: np.ndarray
    v: np.ndarray
    M: np.ndarray
    bias: np.ndarray
    axes: np.ndarray
    placement: np.ndarray
    parent: np.ndarray
    frames: Mapping[int, FramePlace]
    masses: Masses
    bodies: Record = field(default_factory=no_bodies)
    dynamics: Record = field(default_factory=lambda: make_dynamics(no_bodies(), 0))
    later: Record = field(default_factory=lambda: make_dynamics(no_bodies(), 0))
    followers: bool = False
