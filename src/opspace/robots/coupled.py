"""A robot some of whose joints follow others, as a gripper's fingers do."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from opspace.errors import ModelError
from opspace.robots.adapter import AdapterBase
from opspace.robots.description import Description
from opspace.robots.motion_axes import FramePlace, MassPoint, MotionAxes
from opspace.robots.payload import Masses
from opspace.robots.rigid_model import RigidModel
from opspace.robots.spread import Spread


class CoupledRobot(AdapterBase):
    """A robot with the coordinates of the joints that lead; exact for linear relations.

    With v_all = G v the inertia is Gᵀ M G and the bias Gᵀ (b + g), for G is constant. Compiled code
    takes both from here, and moves the frames that no follower moves; the others it asks this robot for.
    """

    _model: AdapterBase

    def __init__(self, description: Description, model: AdapterBase) -> None:
        """Wrap a robot.

        Args:
            description: Names, limits and postures of the joints that lead.
            model: The robot with every joint on its own.
        """
        super().__init__(description)
        self._model = model
        self.spread = self._all = Spread.of(model.joint_names, description.couplings)
        self._G = self._all.G
        self._own = model._motion_axes()
        self._axes = np.zeros((self.nv, 6))
        self._hold(np.zeros((self.nv, self.nv)), np.zeros(self.nv))
        self.update(self.q_reference, np.zeros(self.nv))

    def _fresh(self) -> CoupledRobot:
        return CoupledRobot(self.description, self._model.fresh())

    def _motion_axes(self) -> MotionAxes | None:
        """Return the arrays of the joints that lead; what followers move is hidden."""
        own = self._own
        if own is None:
            return None
        place = {int(i): k for k, i in enumerate(self._all.leaders)}

        def above(joint: int) -> tuple[int, bool]:
            """Find the nearest joint that leads on the way to the base, and whether none follows."""
            hidden, last = False, -1
            while joint >= 0:
                if joint not in place:
                    hidden = True
                elif last < 0:
                    last = place[joint]
                joint = int(own.parent[joint])
            return last, hidden

        frames: dict[int, FramePlace] = {}
        for id_, frame in own.frames.items():
            joint, hidden = above(frame.joint)
            frames[id_] = FramePlace(frame.body, joint, frame.local, hidden)
        links = [
            MassPoint(int(body), above(int(joint))[0], float(point[0]), point[1:].copy())
            for (body, joint), point in zip(own.masses.place, own.masses.points, strict=True)
        ]
        return MotionAxes(
            q=self._q,
            v=self._v,
            M=self._M,
            bias=self._bias,
            axes=self._axes,
            placement=own.placement,
            parent=np.array([above(int(own.parent[i]))[0] for i in self._all.leaders]),
            frames=frames,
            masses=Masses(links, frames),
            followers=True,
        )

    def _rigid_model(self) -> RigidModel | None:
        """Return None: one coordinate moves several joints."""
        return None

    def integrate(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Return q + v dt, (nq,)."""
        return np.asarray(q, dtype=float) + np.asarray(v, dtype=float) * dt

    def difference(self, q0: np.ndarray, q1: np.ndarray) -> np.ndarray:
        """Return v, (nv,), such that integrate(q0, v, 1) is q1."""
        return np.asarray(q1, dtype=float) - np.asarray(q0, dtype=float)

    def _compute(self) -> None:
        G, model = self._G, self._model
        model.update(self._all.positions(self._q), G @ self._v)
        self._M[:] = G.T @ model.M @ G
        self._bias[:] = G.T @ model.bias
        if self._own is not None:
            np.take(self._own.axes, self._all.leaders, axis=0, out=self._axes)

    def _links(self) -> tuple[float, np.ndarray]:
        return self._model._links()

    def _gravity(self, _: int) -> np.ndarray:
        return self._G.T @ self._model.gravity

    def _position(self, frame: int) -> np.ndarray:
        return np.array(self._model.position(frame))

    def _rotation(self, frame: int) -> np.ndarray:
        return np.array(self._model.rotation(frame))

    def _jacobian(self, frame: int) -> np.ndarray:
        return self._model.jacobian(frame) @ self._G

    def _drift(self, frame: int) -> np.ndarray:
        return np.array(self._model.drift(frame))

    def _com(self, _: int) -> np.ndarray:
        return np.array(self._model.com_position())

    def _com_jacobian(self, _: int) -> np.ndarray:
        return self._model.com_jacobian() @ self._G

    def _com_drift(self, _: int) -> np.ndarray:
        return np.array(self._model.com_drift())


def coupled_description(description: Description) -> Description:
    """Leave the leaders of a description, with limits that keep their followers within theirs.

    Args:
        description: Of all joints, ``couplings`` among them.

    Returns:
        That of the joints that lead.

    Raises:
        ModelError: Joints with several coordinates are there too, or no position of a leader
            suits its followers.
    """
    if description.nq != description.nv:
        raise ModelError(
            f"{description.source or description.name}: joints that follow others beside joints "
            "with several coordinates are not supported; lock them"
        )
    spread = Spread.of(description.joint_names, description.couplings)
    leaders = spread.leaders
    limits = {
        "q_lower": description.q_lower[leaders].copy(),
        "q_upper": description.q_upper[leaders].copy(),
        "velocity_limit": description.velocity_limit[leaders].copy(),
    }
    place = {description.joint_names[i]: k for k, i in enumerate(leaders)}
    at = {name: i for i, name in enumerate(description.joint_names)}
    for c in description.couplings:
        if c.ratio != 0.0:
            _narrow(limits, place[c.leader], at[c.follower], c.ratio, c.offset, description)
    for name, k in place.items():
        if limits["q_lower"][k] >= limits["q_upper"][k]:
            following = [c.follower for c in description.couplings if c.leader == name]
            raise ModelError(
                f"{description.source or description.name}: no position of joint {name!r} keeps "
                f"{', '.join(following)}, which follow it, within their limits; lock it"
            )
    q = np.clip(description.q_reference[leaders], limits["q_lower"], limits["q_upper"])
    names, uneven = description.joint_names, description.torque_range
    changed: dict[str, Any] = {
        **limits,
        "nq": len(leaders),
        "nv": len(leaders),
        "joint_names": tuple(names[i] for i in leaders),
        "joint_units": tuple(description.joint_units[i] for i in leaders),
        "q_reference": q,
        "torque_limit": description.torque_limit[leaders],
        "torque_range": None if uneven is None else uneven[:, leaders],
        "actuated": description.actuated[leaders],
        "configurations": {n: q[leaders] for n, q in description.configurations.items()},
    }
    return replace(description, **changed)


def _narrow(
    limits: dict[str, np.ndarray],
    leader: int,
    follower: int,
    ratio: float,
    offset: float,
    description: Description,
) -> None:
    """Bring the limits of a follower over to its leader."""
    ends = (
        (description.q_lower[follower] - offset) / ratio,
        (description.q_upper[follower] - offset) / ratio,
    )
    limits["q_lower"][leader] = max(limits["q_lower"][leader], min(ends))
    limits["q_upper"][leader] = min(limits["q_upper"][leader], max(ends))
    speed = description.velocity_limit[follower] / abs(ratio)
    limits["velocity_limit"][leader] = min(limits["velocity_limit"][leader], speed)
