"""The robot protocol on MuJoCo."""

# The compiled module mujoco has no type stubs.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco
import numpy as np

from opspace.robots.adapter import AdapterBase
from opspace.robots.description import Description
from opspace.robots.motion_axes import FramePlace, MassPoint, MotionAxes
from opspace.robots.mujoco_names import frames
from opspace.robots.passive_forces import carries_weight
from opspace.robots.payload import Masses
from opspace.robots.pinocchio_model import carried_from_mujoco, frame_ids, model_from_mujoco
from opspace.robots.rigid_model import RigidModel, rigid_model
from opspace.robots.world_axes import WorldAxes


class MujocoRobot(AdapterBase):
    """A robot whose dynamics MuJoCo computes."""

    def __init__(self, description: Description, model: mujoco.MjModel) -> None:
        """Wrap a model.

        Args:
            description: Names, limits and postures, in the model's order.
            model: The compiled model; it is never changed.
        """
        super().__init__(description)
        self._model = model
        self._data = mujoco.MjData(model)
        places = {frame.name: frame for frame in frames(model)}
        self._sites = [places[name].site for name in self.frame_names]
        self._bodies = [places[name].body for name in self.frame_names]
        moving = model.body_weldid > 0
        self._massive = np.flatnonzero(moving & (model.body_mass > 0.0)).tolist()
        self._mass = model.body_mass * moving
        self._total_mass = float(self._mass.sum())
        self._carries = carries_weight(model)
        self._hold(np.zeros((self.nv, self.nv)), np.zeros(self.nv))
        self._world = WorldAxes(model, self._data)
        self.update(self.q_reference, np.zeros(self.nv))

    def _fresh(self) -> MujocoRobot:
        return MujocoRobot(self.description, self._model)

    def _motion_axes(self) -> MotionAxes | None:
        model = self._model
        if self.nq != self.nv or model.njnt != self.nv:
            return None
        frames = {
            id_: FramePlace(body, self._last_dof(body), self._on_body(site))
            for id_, (body, site) in enumerate(zip(self._bodies, self._sites, strict=True))
        }
        links = [
            MassPoint(b, self._last_dof(b), float(model.body_mass[b]), model.body_ipos[b].copy())
            for b in np.flatnonzero(model.body_weldid > 0).tolist()
        ]
        return MotionAxes(
            q=self._q,
            v=self._v,
            M=self._M,
            bias=self._bias,
            axes=self._world.axes,
            placement=self._world.placement,
            parent=np.array(model.dof_parentid, dtype=np.int64),
            frames=frames,
            masses=Masses(links, frames),
        )

    def _rigid_model(self) -> RigidModel | None:
        """Return the bodies as numbers; they are those of the same model in Pinocchio."""
        model = model_from_mujoco(self._model)
        carried = carried_from_mujoco(self._model)
        return rigid_model(
            model, frame_ids(model, self.description), carried, self.description.springs
        )

    def _on_body(self, site: int) -> np.ndarray:
        """Return where a site is on its body, (12,); nowhere else for the body itself, −1."""
        rotation, position = np.eye(3).reshape(9), np.zeros(3)
        if site >= 0:
            mujoco.mju_quat2Mat(rotation, self._model.site_quat[site])
            position = self._model.site_pos[site]
        return np.concatenate((rotation.reshape(3, 3).T.reshape(9), position))

    def _last_dof(self, body: int) -> int:
        """Return the last joint coordinate that moves a body, −1 for none."""
        carrier = self._model.body_weldid[body]
        count = int(self._model.body_dofnum[carrier])
        return int(self._model.body_dofadr[carrier]) + count - 1 if count else -1

    def integrate(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Return q ⊕ v dt on the configuration manifold, (nq,)."""
        moved = np.array(q, dtype=float)
        mujoco.mj_integratePos(self._model, moved, np.asarray(v, dtype=float), dt)
        return moved

    def difference(self, q0: np.ndarray, q1: np.ndarray) -> np.ndarray:
        """Return v, (nv,), such that integrate(q0, v, 1) is q1."""
        v = np.zeros(self.nv)
        mujoco.mj_differentiatePos(
            self._model, v, 1.0, np.asarray(q0, dtype=float), np.asarray(q1, dtype=float)
        )
        return v

    def _compute(self) -> None:
        model, data = self._model, self._data
        data.qpos[:] = self._q
        data.qvel[:] = self._v
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_fullM(model, data, self._M)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, self._bias)
        if self._carries:
            self._bias -= self._weight_carried()
        if self.description.springs is not None:
            self.description.springs.add_to(self._bias, self._q)
        self._world.fill()

    def _links(self) -> tuple[float, np.ndarray]:
        return self._total_mass, np.array(self._model.opt.gravity)

    def _gravity(self, _: int) -> np.ndarray:
        # g(q) = -sum_i m_i J_i^T g, which is the whole mass at the centre of mass.
        g = -self._total_mass * (self._com_jacobian(0).T @ self._model.opt.gravity)
        return g - self._weight_carried() if self._carries else g

    def _weight_carried(self) -> np.ndarray:
        model, data = self._model, self._data
        carried = np.zeros(self.nv)
        for body in np.flatnonzero(model.body_gravcomp):
            lift = -model.body_gravcomp[body] * model.body_mass[body] * model.opt.gravity
            point = data.xipos[body]
            mujoco.mj_applyFT(model, data, lift, np.zeros(3), point, int(body), carried)
        return carried

    def _position(self, frame: int) -> np.ndarray:
        site = self._sites[frame]
        data = self._data
        return np.array(data.xpos[self._bodies[frame]] if site < 0 else data.site_xpos[site])

    def _rotation(self, frame: int) -> np.ndarray:
        site = self._sites[frame]
        data = self._data
        matrix = data.xmat[self._bodies[frame]] if site < 0 else data.site_xmat[site]
        return matrix.reshape(3, 3).copy()

    def _jacobian(self, frame: int) -> np.ndarray:
        J = np.zeros((6, self.nv))
        point = self.position(frame)
        mujoco.mj_jac(self._model, self._data, J[:3], J[3:], point, self._bodies[frame])
        return J

    def _drift(self, frame: int) -> np.ndarray:
        Jdot = np.zeros((6, self.nv))
        point = self.position(frame)
        mujoco.mj_jacDot(self._model, self._data, Jdot[:3], Jdot[3:], point, self._bodies[frame])
        return Jdot @ self._v

    def _com(self, _: int) -> np.ndarray:
        return self._mass @ self._data.xipos / self._total_mass

    def _com_jacobian(self, _: int) -> np.ndarray:
        # MuJoCo counts the links that are fixed to the world; they do not move.
        J = np.zeros((3, self.nv))
        mujoco.mj_jacSubtreeCom(self._model, self._data, J, 0)
        return J * (self._model.body_subtreemass[0] / self._total_mass)

    def _com_drift(self, _: int) -> np.ndarray:
        Jdot, total = np.zeros((3, self.nv)), np.zeros((3, self.nv))
        for body in self._massive:
            point = self._data.xipos[body]
            mujoco.mj_jacDot(self._model, self._data, Jdot, None, point, body)
            total += self._mass[body] * Jdot
        return total @ self._v / self._total_mass
