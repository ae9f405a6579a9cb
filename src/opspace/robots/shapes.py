"""The space that a robot takes up: capsules on its links, and which of them may touch each other."""

# The compiled modules have no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from opspace.errors import ModelError
from opspace.robots.adapter import held_joints
from opspace.robots.protocol import Robot
from opspace.robots.urdf import read_urdf

Triple: TypeAlias = tuple[float, float, float]

PACKAGE_DEPTH = 8
"""Directories above a URDF file in which its packages are looked for."""

SAG = 3e-3
"""How far balls on the axis of a capsule may stand out of it, m."""

RIM = 32
"""Corners of the polygon that stands for a circle."""


@dataclass(frozen=True)
class LinkCapsule:
    """A capsule that encloses a link, or a part of it.

    Attributes:
        frame: Frame of the robot that it is fixed to.
        start: (3,) centre of one end in the axes of the frame, m.
        end: (3,) centre of the other end; the same makes a ball.
        radius: m.
    """

    frame: str
    start: Triple
    end: Triple
    radius: float

    def balls(self) -> tuple[np.ndarray, float]:
        """Cover it with balls on its axis, as many as keep them from standing out by more than `SAG`.

        Balls of radius R, h apart, cover all that is nearer to the axis than √(R² − h²/4).

        Returns:
            (k, 3) centres in the axes of the frame, and their radius, m.
        """
        start, end = np.array(self.start), np.array(self.end)
        length = float(np.linalg.norm(end - start))
        widest = 2.0 * math.sqrt((self.radius + SAG) ** 2 - self.radius**2)
        gaps = math.ceil(length / widest)
        if gaps == 0:
            return start[None], self.radius
        share = np.linspace(0.0, 1.0, gaps + 1)[:, None]
        radius = math.hypot(self.radius, 0.5 * length / gaps)
        return start + share * (end - start), radius


def shapes_of(robot: Robot) -> tuple[LinkCapsule, ...]:
    """Enclose the links of a robot in capsules, from the collision geometry of its file.

    Balls and capsules of the file stay what they are. What else a link has, such as boxes, cylinders
    and meshes, is enclosed in one capsule of the least volume. An MJCF file in which nothing collides
    is taken by what it shows.

    Args:
        robot: The robot.

    Returns:
        The capsules, link by link.

    Raises:
        ModelError: The robot was not read from a file, or the file has no geometry that can be read.
    """
    if robot.source is None:
        raise ModelError(f"robot {robot.name!r} was not read from a file: give its shapes")
    read = _urdf_pieces if robot.source.suffix == ".urdf" else _mjcf_pieces
    names = set(robot.frame_names)
    found: list[LinkCapsule] = []
    loose: dict[str, list[np.ndarray]] = {}
    for frame, piece in read(robot.source, robot):
        if frame not in names:
            continue
        if isinstance(piece, LinkCapsule):
            found.append(piece)
        else:
            loose.setdefault(frame, []).append(piece)
    for frame, pieces in loose.items():
        found.append(LinkCapsule(frame, *_enclosing(np.concatenate(pieces).tobytes())))
    if not found:
        raise ModelError(f"{robot.source}: no link has a shape: give the robot's shapes")
    return tuple(sorted(found, key=lambda shape: robot.frame_id(shape.frame)))


@lru_cache(maxsize=1)
def _mesh_loader() -> Any:
    """Return what reads a mesh again only if its file has changed."""
    import coal  # noqa: PLC0415 - comes with Pinocchio

    return coal.CachedMeshLoader()


@lru_cache(maxsize=256)
def _enclosing(points: bytes) -> tuple[Triple, Triple, float]:
    from opspace.robots.enclosing import enclosing_capsule  # noqa: PLC0415 - imports SciPy's solvers

    start, end, radius = enclosing_capsule(np.frombuffer(points).reshape(-1, 3))
    return _triple(start), _triple(end), radius


def _triple(x: np.ndarray) -> Triple:
    a, b, c = x.tolist()
    return a, b, c


def _urdf_pieces(path: Path, robot: Robot) -> Iterator[tuple[str, np.ndarray | LinkCapsule]]:
    """Give the collision geometry of a URDF: capsules, or points (k, 3) whose hull a piece is [m]."""
    import pinocchio as pin  # noqa: PLC0415 - slow, and only robots from URDF have it

    from opspace.robots.pinocchio_model import model_from_urdf  # noqa: PLC0415

    free = robot.floating_base
    model = model_from_urdf(read_urdf(path, held_joints(robot), free), free)
    directories = [str(parent) for parent in path.resolve().parents[:PACKAGE_DEPTH]]
    try:
        geometry = pin.buildGeomFromUrdf(
            model,
            str(path),
            pin.GeometryType.COLLISION,
            package_dirs=directories,
            mesh_loader=_mesh_loader(),
        )
    except (ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split())
        raise ModelError(f"{path}: its collision geometry cannot be read: {reason}") from None
    for found in geometry.geometryObjects:
        frame = model.frames[found.parentFrame]
        place = frame.placement.inverse() * found.placement
        shape, R, p = found.geometry, place.rotation, place.translation
        kind = type(shape).__name__
        if kind in ("Sphere", "Capsule"):
            half = R[:, 2] * (shape.halfLength if kind == "Capsule" else 0.0)
            yield frame.name, _capsule(frame.name, p, half, shape.radius)
        elif kind == "Box":
            yield frame.name, p + _corners(np.asarray(shape.halfSide)) @ R.T
        elif kind in ("Cylinder", "Cone"):
            yield frame.name, p + _drum(shape.radius, shape.halfLength) @ R.T
        else:
            points = np.array(shape.vertices()) * np.asarray(found.meshScale)
            yield frame.name, p + points.reshape(-1, 3) @ R.T


def _mjcf_pieces(path: Path, robot: Robot) -> Iterator[tuple[str, np.ndarray | LinkCapsule]]:
    """Give the geometry of an MJCF file, as `_urdf_pieces` does."""
    import mujoco  # noqa: PLC0415 - an extra

    from opspace.robots.mujoco_model import model_of  # noqa: PLC0415

    model = model_of(robot)
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    kinds = mujoco.mjtGeom
    taken = collides if np.any(collides[model.geom_bodyid > 0]) else np.ones(model.ngeom, bool)
    for g in np.flatnonzero(taken & (model.geom_bodyid > 0)):
        frame = model.body(int(model.geom_bodyid[g])).name
        kind, size, p = kinds(model.geom_type[g]), model.geom_size[g], model.geom_pos[g]
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, model.geom_quat[g])
        R = R.reshape(3, 3)
        if kind in (kinds.mjGEOM_SPHERE, kinds.mjGEOM_CAPSULE):
            half = R[:, 2] * (size[1] if kind == kinds.mjGEOM_CAPSULE else 0.0)
            yield frame, _capsule(frame, p, half, float(size[0]))
        elif kind == kinds.mjGEOM_CYLINDER:
            yield frame, p + _drum(float(size[0]), float(size[1])) @ R.T
        elif kind == kinds.mjGEOM_MESH:
            mesh = int(model.geom_dataid[g])
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            yield frame, p + model.mesh_vert[first : first + count].astype(float) @ R.T
        elif kind in (kinds.mjGEOM_BOX, kinds.mjGEOM_ELLIPSOID):
            yield frame, p + _corners(np.asarray(size)) @ R.T


def _capsule(frame: str, middle: np.ndarray, half: np.ndarray, radius: float) -> LinkCapsule:
    return LinkCapsule(frame, _triple(middle - half), _triple(middle + half), float(radius))


def _corners(half: np.ndarray) -> np.ndarray:
    return np.stack(np.meshgrid(*np.stack([-half, half], axis=1)), axis=-1).reshape(-1, 3)


def _drum(radius: float, half: float) -> np.ndarray:
    """Corners of a prism that encloses a cylinder along z."""
    angle = 2.0 * math.pi * np.arange(RIM) / RIM
    around = radius / math.cos(math.pi / RIM)
    rim = np.stack([around * np.cos(angle), around * np.sin(angle)], axis=1)
    ends = [np.column_stack([rim, np.full(RIM, z)]) for z in (-half, half)]
    return np.concatenate(ends)


def joints_that_move(robot: Robot, frames: Sequence[str]) -> list[frozenset[int]]:
    """Tell which velocity coordinates move each frame.

    Args:
        robot: The robot; it is not changed.
        frames: Names of frames.

    Returns:
        Their coordinates, none for what is fixed to the world.
    """
    probe, still = robot.fresh(), np.zeros(robot.nv)
    found: list[set[int]] = [set() for _ in frames]
    # One posture may hide a joint, in a column of zeros; two do not.
    for way in (0.0, 0.1):
        probe.update(probe.integrate(robot.q_reference, np.full(robot.nv, way), 1.0), still)
        for name, joints in zip(frames, found, strict=True):
            J = probe.jacobian(probe.frame_id(name))
            joints.update(np.flatnonzero(np.any(J != 0.0, axis=0)).tolist())
    return [frozenset(joints) for joints in found]
