"""A robot as the numbers that compiled code needs to compute its dynamics by itself."""

# The compiled module pinocchio has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from opspace.machine.field_table import Record
from opspace.robots.bodies import RIGID_BODIES, make_dynamics
from opspace.robots.description import Springs
from opspace.robots.joint_kinds import ALIGNED, BALL, HINGE, SLIDE, TRANSLATION
from opspace.robots.motion_axes import FramePlace, MassPoint, MotionAxes
from opspace.robots.payload import Masses


@dataclass(frozen=True)
class RigidModel:
    """Bodies of a robot, and what is fixed to them.

    Attributes:
        bodies: The tree, `RIGID_BODIES`.
        frames: Frames by the robot's own ids.
        masses: Mass of the moving links, with what they carry; it is in the tree as well.
    """

    bodies: Record
    frames: Mapping[int, FramePlace]
    masses: Masses

    def motion_axes(self, q: np.ndarray, v: np.ndarray) -> MotionAxes:
        """Return the arrays that compiled code reads of a robot that it computes itself.

        Args:
            q: (nq,) the configuration that it reads.
            v: (n,) the velocity.
        """
        dynamics, later = (make_dynamics(self.bodies, q.size) for _ in range(2))
        return MotionAxes(
            q=q,
            v=v,
            M=dynamics.M,
            bias=dynamics.bias,
            axes=dynamics.axes,
            placement=dynamics.placement,
            parent=self.bodies.before,
            frames=self.frames,
            masses=self.masses,
            bodies=self.bodies,
            dynamics=dynamics,
            later=later,
        )


def rigid_model(
    model: Any, frames: Sequence[int], carried: Any = None, springs: Springs | None = None
) -> RigidModel | None:
    """Read the bodies of a model.

    Args:
        model: The ``pinocchio.Model``.
        frames: The model's index of each frame of the robot.
        carried: The ``pinocchio.Model`` of the masses whose weight is carried; None for none.
        springs: Springs at the joints.

    Returns:
        The bodies, or None if there is a joint other than hinges, slides, ball joints and
        translations (of which a free joint is made).
    """
    joints = [_joint(model, j) for j in range(1, model.njoints)]
    if any(joint is None for joint in joints):
        return None
    known = [_WORLD, *(joint for joint in joints if joint is not None)]
    integers = np.int64
    places = [_numbers(placement) for placement in model.jointPlacements]
    inertias = [_WORLD_INERTIA, *list(model.inertias)[1:]]
    weights = inertias if carried is None else [_WORLD_INERTIA, *list(carried.inertias)[1:]]
    stiffness, relaxed = np.zeros(model.nv), np.zeros(model.nv)
    if springs is not None:
        stiffness[springs.coordinates] = springs.stiffness
        relaxed[springs.coordinates] = springs.relaxed
    last = np.array([-1, *(j.first_v + j.width - 1 for j in known[1:])], integers)
    fields = {
        "kind": np.array([j.kind for j in known], integers),
        "parent": np.array([model.parents[i] for i in range(model.njoints)], integers),
        "place": np.array(places),
        "axis": np.array([j.axis for j in known]),
        "along": np.array([int(np.argmax(j.axis)) for j in known], integers),
        "first_q": np.array([j.first_q for j in known], integers),
        "first_v": np.array([j.first_v for j in known], integers),
        "width": np.array([j.width for j in known], integers),
        "mass": np.array([float(inertia.mass) for inertia in inertias]),
        "centre": np.array([inertia.lever for inertia in inertias], float).reshape(-1, 3),
        "tensor": np.array([_tensor(inertia) for inertia in inertias]),
        "before": _before(model, known, last),
        "armature": np.array(model.armature, float),
        "gravity": np.array(model.gravity.linear, float),
        "carried": np.array([0.0 if carried is None else float(w.mass) for w in weights]),
        "carried_at": np.array([w.lever for w in weights], float).reshape(-1, 3),
        "stiffness": stiffness,
        "relaxed": relaxed,
    }
    bodies, places = RIGID_BODIES.make({}, fields), frame_places(model, frames, last)
    return RigidModel(bodies, places, Masses(mass_points(model, last), places, bodies))


def frame_places(model: Any, frames: Sequence[int], last: np.ndarray) -> dict[int, FramePlace]:
    """Return where frames are fixed.

    Args:
        model: The ``pinocchio.Model``.
        frames: The model's index of each frame.
        last: (joints,) last velocity coordinate of each joint, −1 of the world.

    Returns:
        Their places, by their position in ``frames``.
    """
    found: dict[int, FramePlace] = {}
    for id_, index in enumerate(frames):
        frame = model.frames[index]
        joint = int(frame.parentJoint)  # 0 is the world
        found[id_] = FramePlace(joint, int(last[joint]), _numbers(frame.placement))
    return found


def mass_points(model: Any, last: np.ndarray) -> tuple[MassPoint, ...]:
    """Return the mass of the moving links of a model, also where it is zero.

    Args:
        model: The ``pinocchio.Model``.
        last: (joints,) last velocity coordinate of each joint, −1 of the world.
    """
    return tuple(
        MassPoint(j, int(last[j]), float(inertia.mass), np.array(inertia.lever))
        for j, inertia in enumerate(model.inertias)
        if j > 0
    )


class _Joint(NamedTuple):
    kind: int
    axis: np.ndarray
    first_q: int
    first_v: int
    width: int


_WORLD = _Joint(HINGE, np.zeros(3), 0, 0, 0)
_WORLD_INERTIA = pin.Inertia.Zero()


def _joint(model: Any, j: int) -> _Joint | None:
    """Tell what kind of joint it is by how it moves, whatever class the model has for it."""
    joint = model.joints[j]
    data = joint.createData()
    joint.calc(data, pin.neutral(model))
    S = np.array(data.S, float).reshape(6, -1)
    linear, angular = S[:3], S[3:]
    first = int(joint.idx_q), int(joint.idx_v)
    if (joint.nq, joint.nv) == (1, 1):
        turns, slides = np.any(angular), np.any(linear)
        if turns and not slides:
            axis = angular[:, 0]
            return _Joint(ALIGNED if sorted(axis) == [0.0, 0.0, 1.0] else HINGE, axis, *first, 1)
        if slides and not turns:
            return _Joint(SLIDE, linear[:, 0], *first, 1)
    identity = np.eye(3)
    if (joint.nq, joint.nv) == (3, 3) and np.array_equal(linear, identity) and not angular.any():
        return _Joint(TRANSLATION, np.zeros(3), *first, 3)
    if (joint.nq, joint.nv) == (4, 3) and np.array_equal(angular, identity) and not linear.any():
        return _Joint(BALL, np.zeros(3), *first, 3)
    return None


def _before(model: Any, joints: list[_Joint], last: np.ndarray) -> np.ndarray:
    """Return the velocity coordinate before each one, −1 for none."""
    before = np.full(model.nv, -1, np.int64)
    for i in range(1, model.njoints):
        first = joints[i].first_v
        before[first] = last[model.parents[i]]
        for k in range(1, joints[i].width):
            before[first + k] = first + k - 1
    return before


def _tensor(inertia: Any) -> list[float]:
    tensor = np.array(inertia.inertia)
    return [tensor[0, 0], tensor[0, 1], tensor[1, 1], tensor[0, 2], tensor[1, 2], tensor[2, 2]]


def _numbers(placement: Any) -> np.ndarray:
    """Return rotation by columns, then position."""
    return np.concatenate((placement.rotation.T.reshape(9), placement.translation))
