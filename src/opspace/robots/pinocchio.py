"""The robot protocol on Pinocchio."""

# The compiled module pinocchio has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from opspace.robots.adapter import AdapterBase
from opspace.robots.description import Description
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.payload import Masses
from opspace.robots.pinocchio_model import frame_ids
from opspace.robots.rigid_model import RigidModel, frame_places, mass_points, rigid_model

ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
# Looked up once: an attribute of the module costs as much as some of the mathematics.
WORLD_CONVENTION = pin.Convention.WORLD
nonlinear_effects = pin.nonLinearEffects
composite_inertia = pin.crba


class PinocchioRobot(AdapterBase):
    """A robot whose dynamics Pinocchio computes."""

    def __init__(self, description: Description, model: Any, carried: Any = None) -> None:
        """Wrap a model.

        Args:
            description: Names, limits and postures, in the model's order.
            model: The ``pinocchio.Model``; it is never changed.
            carried: Another one, of the masses whose weight is carried for the robot.
        """
        super().__init__(description)
        self._model, self._carried = model, carried
        self._carried_data = None if carried is None else carried.createData()
        self._data = model.createData()
        # Gravity and centre of mass overwrite intermediate results that the frames still need.
        self._scratch = model.createData()
        self._frames = frame_ids(model, description)
        self._zero = np.zeros(self.nv)
        self._to_pin = _quaternion_order(self.nq, description.quaternions, (1, 2, 3, 0))
        self._from_pin = _quaternion_order(self.nq, description.quaternions, (3, 0, 1, 2))
        # M is symmetric; the transpose of Eigen's column-major array is C-contiguous.
        self._hold(self._data.M.T, self._data.nle)
        self._accelerations_known = False
        self._placement = _contiguous_placements(self._data)
        self.update(self.q_reference, self._zero)

    def _parts(self) -> tuple[Any, ...]:
        return self.description, self._model, self._carried

    def _fresh(self) -> PinocchioRobot:
        return PinocchioRobot(self.description, self._model, self._carried)

    def _motion_axes(self) -> MotionAxes | None:
        model = self._model
        if self.nq != self.nv or model.njoints != self.nv + 1 or self._placement is None:
            return None
        last = np.arange(-1, self.nv)
        places = frame_places(model, self._frames, last)
        return MotionAxes(
            q=self._q,
            v=self._v,
            M=self._data.M.T,
            bias=self._data.nle,
            axes=self._data.J.T,
            placement=self._placement,
            parent=np.array([model.parents[j] - 1 for j in range(1, model.njoints)]),
            frames=places,
            masses=Masses(mass_points(model, last), places),
        )

    def _rigid_model(self) -> RigidModel | None:
        return rigid_model(self._model, self._frames, self._carried, self.description.springs)

    def integrate(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Return q ⊕ v dt on the configuration manifold, (nq,)."""
        moved = pin.integrate(self._model, self._order(q), np.asarray(v, dtype=float) * dt)
        return moved[self._from_pin] if self._from_pin is not None else moved

    def difference(self, q0: np.ndarray, q1: np.ndarray) -> np.ndarray:
        """Return v, (nv,), such that integrate(q0, v, 1) is q1."""
        return pin.difference(self._model, self._order(q0), self._order(q1))

    def _order(self, q: np.ndarray) -> np.ndarray:
        q = np.asarray(q, dtype=float)
        return q[self._to_pin] if self._to_pin is not None else q

    def _compute(self) -> None:
        model, data, q = self._model, self._data, self._q
        if self._to_pin is not None:
            q = q[self._to_pin]
        self._q_pin = q
        self._accelerations_known = False
        nonlinear_effects(model, data, q, self._v)
        # The world convention leaves the joint Jacobians in the data, which the frames read.
        composite_inertia(model, data, q, WORLD_CONVENTION)
        if self._carried is not None:
            self._bias -= self._weight_carried()
        if self.description.springs is not None:
            self.description.springs.add_to(self._bias, self._q)

    def _weight_carried(self) -> np.ndarray:
        return pin.computeGeneralizedGravity(self._carried, self._carried_data, self._q_pin)

    def _links(self) -> tuple[float, np.ndarray]:
        mass = sum(float(inertia.mass) for inertia in list(self._model.inertias)[1:])
        return mass, np.array(self._model.gravity.linear)

    def _gravity(self, _: int) -> np.ndarray:
        g = np.array(pin.computeGeneralizedGravity(self._model, self._scratch, self._q_pin))
        return g if self._carried is None else g - self._weight_carried()

    def _position(self, frame: int) -> np.ndarray:
        placement = pin.updateFramePlacement(self._model, self._data, self._frames[frame])
        return np.array(placement.translation)

    def _rotation(self, frame: int) -> np.ndarray:
        placement = pin.updateFramePlacement(self._model, self._data, self._frames[frame])
        return np.array(placement.rotation, order="C")

    def _jacobian(self, frame: int) -> np.ndarray:
        J = pin.getFrameJacobian(self._model, self._data, self._frames[frame], ALIGNED)
        return np.ascontiguousarray(J).reshape(6, self.nv)  # one joint gives a vector

    def _drift(self, frame: int) -> np.ndarray:
        if not self._accelerations_known:
            # At zero acceleration a frame's acceleration is its drift Jdot v.
            pin.forwardKinematics(self._model, self._data, self._q_pin, self._v, self._zero)
            self._accelerations_known = True
        motion = pin.getFrameClassicalAcceleration(
            self._model, self._data, self._frames[frame], ALIGNED
        )
        return np.array(motion.vector)

    def _com(self, _: int) -> np.ndarray:
        return np.array(pin.centerOfMass(self._model, self._scratch, self._q_pin))

    def _com_jacobian(self, _: int) -> np.ndarray:
        J = pin.jacobianCenterOfMass(self._model, self._scratch, self._q_pin)
        return np.array(J, order="C").reshape(3, self.nv)

    def _com_drift(self, _: int) -> np.ndarray:
        pin.centerOfMass(self._model, self._scratch, self._q_pin, self._v, self._zero)
        return np.array(self._scratch.acom[0])


def _quaternion_order(
    nq: int, quaternions: tuple[int, ...], order: tuple[int, int, int, int]
) -> np.ndarray | None:
    """Return the index that reorders every quaternion of q, or None where there is none."""
    if not quaternions:
        return None
    index = np.arange(nq)
    for start in quaternions:
        index[start : start + 4] = start + np.array(order)
    return index


def _contiguous_placements(data: Any) -> np.ndarray | None:
    """Return a view (joints, 12) on the joint placements, or None where they lie otherwise.

    They are one vector of nine numbers of rotation and three of position each, which is checked.
    """
    first = data.oMi[0].rotation
    start, size = first.ctypes.data, 12 * first.itemsize
    for j in range(len(data.oMi)):
        rotation, translation = data.oMi[j].rotation, data.oMi[j].translation
        if (
            rotation.ctypes.data != start + j * size
            or translation.ctypes.data != start + j * size + 9 * first.itemsize
            or not rotation.flags.f_contiguous
        ):
            return None
    return np.lib.stride_tricks.as_strided(
        first.T, shape=(len(data.oMi), 12), strides=(size, first.itemsize)
    )
