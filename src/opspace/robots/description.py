"""What a robot file says besides dynamics: names, limits and postures."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from opspace.robots.joint_roles import Coupling

WORLD = "world"
BASE_JOINT = "floating_base"


@dataclass(frozen=True)
class ModelOrigin:
    """Where a model comes from; as text it is what errors call it.

    Attributes:
        label: What errors call it in full.
        name: What they call it where it is known which one is meant.
        robot: Name of a robot that has no other.
        file: The file that it was read from; None for one from memory.
    """

    label: str
    name: str
    robot: str
    file: Path | None = None

    @classmethod
    def of(cls, path: Path) -> ModelOrigin:
        """Return that of a file."""
        return cls(str(path), path.name, path.stem, path)

    def __str__(self) -> str:
        return self.label


@dataclass(frozen=True)
class Springs:
    """Linear springs at joints.

    Attributes:
        coordinates: (k,) their velocity coordinates.
        entries: (k,) the entries of q that they stretch with.
        stiffness: (k,) N·m/rad or N/m.
        relaxed: (k,) where they pull nowhere, rad or m.
    """

    coordinates: np.ndarray
    entries: np.ndarray
    stiffness: np.ndarray
    relaxed: np.ndarray

    def add_to(self, bias: np.ndarray, q: np.ndarray) -> None:
        """Add the torque that holds them at q (nq,) to a bias (nv,), N·m or N."""
        bias[self.coordinates] += self.stiffness * (q[self.entries] - self.relaxed)


@dataclass(frozen=True)
class Description:
    """Names, limits and postures of a robot, independent of the library that computes it.

    The fields are those of ``opspace.robots.protocol.Robot``.

    Attributes:
        quaternions: Index in q of the first coordinate (w) of every quaternion.
        joint_units: (nv,) unit of each coordinate's position, "rad" or "m".
        torque_range: (2, nv) least and largest torque where the motors of a fully actuated robot are
            not alike in both directions, N·m or N; None where all are.
        springs: What pulls at the joints besides, None for nothing.
        couplings: Joints of the file that follow one of these.
        armature: Inertia of the motor at every joint that a URDF was read with, kg·m² or kg.
        locked: Where joints of the file are held, rad or m; None for those with several
            coordinates, which are held where the file has them.
        warnings: What the file says and the controller does not follow, a sentence each.
    """

    name: str
    source: Path | None
    nq: int
    nv: int
    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    frame_names: tuple[str, ...]
    tool: str
    q_reference: np.ndarray
    q_lower: np.ndarray
    q_upper: np.ndarray
    velocity_limit: np.ndarray
    torque_limit: np.ndarray
    actuated: np.ndarray
    quaternions: tuple[int, ...] = ()
    floating_base: bool = False
    couplings: tuple[Coupling, ...] = ()
    armature: float = 0.0
    locked: Mapping[str, float | None] = field(default_factory=dict)
    configurations: Mapping[str, np.ndarray] = field(default_factory=dict)
    torque_range: np.ndarray | None = None
    springs: Springs | None = None
    warnings: tuple[str, ...] = ()


def mid_range(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the middle of each range, zero where a side is unlimited.

    Args:
        lower: (n,) lower limits.
        upper: (n,) upper limits.

    Returns:
        (n,) middle values.
    """
    limited = np.isfinite(lower) & np.isfinite(upper)
    middle = np.zeros(len(lower))
    middle[limited] = 0.5 * (lower[limited] + upper[limited])
    return middle


def unused(name: str, taken: Collection[str], longer: str = "{}_") -> str:
    """Make a name longer until nothing else is called that.

    Args:
        name: The name that is wanted.
        taken: Names that are given already.
        longer: How one is made of another.

    Returns:
        The name, or one made of it.
    """
    while name in taken:
        name = longer.format(name)
    return name
