"""What a controller may ask of a robot, whichever library computes it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

BASE = 6
"""Coordinates of a floating base in v."""


@runtime_checkable
class Robot(Protocol):
    """A rigid-body model evaluated at one state at a time.

    ``update`` sets the state; every other query answers for that state until the next update.
    Units are SI and radians. Jacobians, velocities and drifts are those of the frame's origin in
    world axes, rows linear then angular. A floating base has q = [x y z, qw qx qy qz, joints] and
    v = [linear velocity of the base origin in world axes, angular velocity in base axes, joint
    rates].

    Attributes:
        name: Name of the robot.
        source: URDF or MJCF file the model was read from.
        nq: Number of configuration coordinates.
        nv: Number of velocity coordinates n.
        joint_names: (nv,) one name per velocity coordinate; "joint/0", "joint/1", ... for joints
            with several.
        frame_names: Every name that ``frame_id`` accepts; the index is the frame's id.
        tool: Name of the default tool frame.
        q_reference: (nq,) bent posture inside the joint limits.
        configurations: Named postures (nq,) that come with the model.
        q_lower: (nv,) lower joint limits in rad or m, -inf where there is none.
        q_upper: (nv,) upper joint limits in rad or m, inf where there is none.
        velocity_limit: (nv,) in rad/s or m/s, inf where unknown.
        torque_limit: (nv,) in N·m or N, in both directions, inf where unknown. Where a direction has
            more, a robot may say so by ``torque_range``, (2, nv) least and largest torque.
        actuated: (nv,) False for the coordinates of a floating base.
        floating_base: Whether the root link moves freely.
        locked_joints: Joints of the file that this model holds fixed.
    """

    name: str
    source: Path | None
    nq: int
    nv: int
    joint_names: tuple[str, ...]
    tool: str
    q_reference: np.ndarray
    configurations: Mapping[str, np.ndarray]
    q_lower: np.ndarray
    q_upper: np.ndarray
    velocity_limit: np.ndarray
    torque_limit: np.ndarray
    actuated: np.ndarray
    floating_base: bool
    locked_joints: tuple[str, ...]

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Return the names of all frames; the index is the frame's id."""
        ...

    @property
    def q(self) -> np.ndarray:
        """Return the configuration of the last update, (nq,), read-only."""
        ...

    @property
    def v(self) -> np.ndarray:
        """Return the velocity of the last update, (nv,), read-only."""
        ...

    @property
    def M(self) -> np.ndarray:
        """Return the joint-space inertia, (nv, nv), symmetric, armature included."""
        ...

    @property
    def bias(self) -> np.ndarray:
        """Return the Coriolis, centrifugal and gravity torque b + g, (nv,) N·m, springs included."""
        ...

    @property
    def gravity(self) -> np.ndarray:
        """Return the gravity torque g alone, (nv,) N·m."""
        ...

    def update(self, q: np.ndarray, v: np.ndarray) -> None:
        """Set the state, q (nq,) and v (nv,)."""
        ...

    def frame_id(self, name: str) -> int:
        """Return the id of a frame by name."""
        ...

    def position(self, frame: int) -> np.ndarray:
        """Return the frame's origin in world axes, (3,) m."""
        ...

    def rotation(self, frame: int) -> np.ndarray:
        """Return R_world_frame, (3, 3)."""
        ...

    def velocity(self, frame: int) -> np.ndarray:
        """Return J v, (6,) m/s and rad/s."""
        ...

    def jacobian(self, frame: int) -> np.ndarray:
        """Return J, (6, nv)."""
        ...

    def drift(self, frame: int) -> np.ndarray:
        """Return Jdot v, (6,): the frame's acceleration at zero joint acceleration."""
        ...

    def com_position(self) -> np.ndarray:
        """Return the centre of mass of the moving links, (3,) m."""
        ...

    def com_jacobian(self) -> np.ndarray:
        """Return the Jacobian of the centre of mass, (3, nv)."""
        ...

    def com_drift(self) -> np.ndarray:
        """Return Jdot v of the centre of mass, (3,) m/s²."""
        ...

    def fresh(self) -> Robot:
        """Return the same robot with a state of its own, cheaply: the model is shared.

        Frame ids are those of this robot, and results are equal to the last bit.
        """
        ...

    def integrate(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Return q ⊕ v dt on the configuration manifold, (nq,)."""
        ...

    def difference(self, q0: np.ndarray, q1: np.ndarray) -> np.ndarray:
        """Return v, (nv,), such that integrate(q0, v, 1) is q1."""
        ...
