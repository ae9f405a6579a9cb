"""What a robot looks like: its meshes and simple shapes, and where they are at a configuration."""

# The compiled modules have no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import pinocchio as pin

from opspace.errors import ModelError, missing_extra
from opspace.robots.adapter import held_joints, spread_of
from opspace.robots.pinocchio_model import model_from_urdf
from opspace.robots.protocol import Robot
from opspace.robots.spread import Spread
from opspace.robots.urdf import read_urdf

try:
    import mujoco
    import trimesh
except ImportError as error:
    raise missing_extra(error.name or "trimesh", "view") from None

from opspace.robots.mujoco_model import model_of
from opspace.robots.mujoco_scene import COLLISION_GROUP, draw_what_is_unseen

PACKAGE_DEPTH = 8
"""Directories above a URDF file in which its packages are looked for."""

PLAIN = (196, 201, 208)
"""Colour of a mesh whose URDF tells none."""

_UNTOLD = 0.9
"""What Pinocchio says of such a mesh, in all three channels."""


@dataclass(frozen=True)
class Shape:
    """One piece of a robot, in axes of its own.

    Attributes:
        vertices: (k, 3) m.
        faces: (f, 3) indices of the corners of the triangles.
        color: Red, green, blue, 0 to 255.
        flat: Whether its edges are sharp.
    """

    vertices: np.ndarray
    faces: np.ndarray
    color: tuple[int, int, int]
    flat: bool


class Visuals(Protocol):
    """The shapes of a robot.

    Attributes:
        shapes: The pieces.
    """

    shapes: tuple[Shape, ...]

    def poses(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tell where the shapes are.

        Args:
            q: (nq,) configuration.

        Returns:
            (k, 3) positions [m] and (k, 4) quaternions wxyz, in the order of ``shapes``.
        """
        ...


def visuals_of(robot: Robot) -> Visuals:
    """Collect the shapes of a robot.

    A robot is shown with its meshes and simple shapes; where they cannot be read, and where it has
    none but for contacts, it is shown as capsules between its joints.

    Args:
        robot: The robot.

    Returns:
        Its shapes.

    Raises:
        ModelError: The robot was not read from a file.
    """
    if robot.source is None:
        raise ModelError(f"robot {robot.name!r} was not read from a file that could be shown")
    if robot.source.suffix == ".urdf":
        found = _UrdfVisuals(robot.source, robot)
        if found.shapes:
            return found
    return _MujocoVisuals(model_of(robot, draw_what_is_unseen), spread_of(robot))


QUATERNION = 4
"""Coordinates of a joint that turns freely."""


class _UrdfVisuals:
    """Meshes of a URDF, read and placed by Pinocchio."""

    def __init__(self, path: Path, robot: Robot) -> None:
        free = robot.floating_base
        self._model = model_from_urdf(read_urdf(path, held_joints(robot), free), free)
        self._quaternions = [j.idx_q for j in self._model.joints if j.nq == QUATERNION]
        self._spread = spread_of(robot)
        self._data = self._model.createData()
        directories = [str(parent) for parent in path.resolve().parents[:PACKAGE_DEPTH]]
        try:
            geometry = pin.buildGeomFromUrdf(
                self._model, str(path), pin.GeometryType.VISUAL, package_dirs=directories
            )
        except (ValueError, RuntimeError):
            # A mesh that is not there is no reason to show nothing.
            geometry = pin.GeometryModel()
        self._geometry, self._placed = geometry, geometry.createData()
        self.shapes = tuple(_urdf_shape(found) for found in geometry.geometryObjects)

    def poses(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Visuals.poses`."""
        q = np.array(q if self._spread is None else self._spread.positions(q))
        for start in self._quaternions:  # Pinocchio writes them xyzw
            end = start + QUATERNION
            q[start:end] = np.roll(q[start:end], -1)
        pin.forwardKinematics(self._model, self._data, q)
        pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._placed)
        places = [pin.SE3ToXYZQUAT(place) for place in self._placed.oMg]
        found = np.array(places).reshape(-1, 7)
        return found[:, :3], found[:, [6, 3, 4, 5]]


class _MujocoVisuals:
    """Shapes of an MJCF file, or the capsules that stand for a robot without any."""

    def __init__(self, model: mujoco.MjModel, spread: Spread | None) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._spread = spread
        # Numbers of a model equal MuJoCo's names from one side only, which `in` does not ask.
        ground = {int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)}
        self._shown = [
            g
            for g in range(model.ngeom)
            if int(model.geom_type[g]) not in ground
            and model.geom_group[g] < COLLISION_GROUP
            and _rgba(model, g)[3] > 0.0
        ]
        self.shapes = tuple(_mujoco_shape(model, g) for g in self._shown)

    def poses(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See `Visuals.poses`."""
        self._data.qpos[:] = q if self._spread is None else self._spread.positions(q)
        mujoco.mj_kinematics(self._model, self._data)
        quaternions = np.empty((len(self._shown), 4))
        for quaternion, g in zip(quaternions, self._shown, strict=True):
            mujoco.mju_mat2Quat(quaternion, self._data.geom_xmat[g])
        return self._data.geom_xpos[self._shown].copy(), quaternions


def _urdf_shape(found: Any) -> Shape:
    shape = found.geometry
    color = PLAIN
    if found.overrideMaterial or not np.allclose(found.meshColor[:3], _UNTOLD):
        color = _rgb(found.meshColor)
    simple = _simple_mesh(shape)
    if simple is not None:
        return _shape(simple, color)
    vertices = np.array(shape.vertices()) * np.asarray(found.meshScale)
    corners = [shape.tri_indices(i) for i in range(shape.num_tris)]
    faces = np.array([[face[0], face[1], face[2]] for face in corners], dtype=np.int64)
    return Shape(vertices.reshape(-1, 3), faces.reshape(-1, 3), color, False)


def _simple_mesh(shape: Any) -> trimesh.Trimesh | None:
    kind = type(shape).__name__
    if kind == "Box":
        return trimesh.creation.box(2.0 * np.asarray(shape.halfSide))
    if kind == "Sphere":
        return trimesh.creation.icosphere(subdivisions=3, radius=shape.radius)
    if kind == "Cylinder":
        return trimesh.creation.cylinder(shape.radius, 2.0 * shape.halfLength)
    if kind == "Capsule":
        return trimesh.creation.capsule(2.0 * shape.halfLength, shape.radius)
    return None


def _mujoco_shape(model: mujoco.MjModel, g: int) -> Shape:
    kind, size = mujoco.mjtGeom(model.geom_type[g]), model.geom_size[g]
    color = _rgb(_rgba(model, g))
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[g])
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        first, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        vertices = np.array(model.mesh_vert[start : start + count], dtype=float)
        return Shape(vertices, np.array(model.mesh_face[first : first + faces]), color, False)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return _shape(trimesh.creation.box(2.0 * size), color)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return _shape(trimesh.creation.cylinder(size[0], 2.0 * size[1]), color)
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return _shape(trimesh.creation.capsule(2.0 * size[1], size[0]), color)
    ball = trimesh.creation.icosphere(subdivisions=3)
    ball.apply_scale(size if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID else size[0])
    return _shape(ball, color)


def _rgb(color: np.ndarray) -> tuple[int, int, int]:
    red, green, blue = (255.0 * np.clip(color[:3], 0.0, 1.0)).round().astype(int).tolist()
    return red, green, blue


def _shape(mesh: trimesh.Trimesh, color: tuple[int, int, int]) -> Shape:
    # Corners of a box, and rims of a cylinder, are edges; those of a ball are not.
    flat = bool(mesh.face_adjacency_angles.max(initial=0.0) > np.radians(60.0))
    return Shape(np.array(mesh.vertices), np.array(mesh.faces), color, flat)


def _rgba(model: mujoco.MjModel, g: int) -> np.ndarray:
    material = int(model.geom_matid[g])
    return model.geom_rgba[g] if material < 0 else model.mat_rgba[material]
