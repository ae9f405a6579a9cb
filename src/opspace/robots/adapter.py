"""What both robot adapters share: the state, its checks and the cache of one update."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError, unknown_name
from opspace.robots.description import Description
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.spread import Spread

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot
    from opspace.robots.rigid_model import RigidModel


class AdapterBase(ABC):
    """A robot whose per-frame quantities are computed on demand and kept until the next update.

    Every array handed out is read-only; ``q``, ``v``, ``M`` and ``bias`` are views that the next
    update overwrites, or the next question after `place`.
    """

    _model: Any
    """What the library computes with; a copy of the robot has a copy of it."""
    _M_view: np.ndarray
    _bias_view: np.ndarray
    """What is handed out as M and bias; ``_compute`` fills their memory."""

    def __init__(self, description: Description) -> None:
        """Take over names, limits and postures.

        Args:
            description: What the robot file says besides dynamics.
        """
        self.description = description
        self.name = description.name
        self.source = description.source
        self.nq = description.nq
        self.nv = description.nv
        self.joint_names = description.joint_names
        self.joint_units = description.joint_units
        self.frame_names = description.frame_names
        self.tool = description.tool
        self.q_reference = _frozen(description.q_reference)
        self.configurations: Mapping[str, np.ndarray] = {
            name: _frozen(q) for name, q in description.configurations.items()
        }
        self.q_lower = _frozen(description.q_lower)
        self.q_upper = _frozen(description.q_upper)
        self.velocity_limit = _frozen(description.velocity_limit)
        self.torque_limit = _frozen(description.torque_limit)
        self.actuated = _frozen(description.actuated)
        self.floating_base = description.floating_base
        self.locked_joints = tuple(description.locked)
        self.spread: Spread | None = None
        self._ids = {name: i for i, name in enumerate(self.frame_names)}
        self._q = np.array(description.q_reference, dtype=float)
        self._v = np.zeros(self.nv)
        self._q_view = _view(self._q)
        self._v_view = _view(self._v)
        # Writing through these takes half the time, and refuses every shape and kind but their own.
        self._q_memory, self._v_memory = self._q.data, self._v.data
        self._cache: dict[tuple[str, int | str], np.ndarray] = {}
        self._behind = False

    def __repr__(self) -> str:
        names = (
            self.joint_names
            if self.nv <= 8
            else (*self.joint_names[:3], "...", self.joint_names[-1])
        )
        base = ", floating base" if self.floating_base else ""
        return (
            f"{type(self).__name__}({self.name!r}{base}, {self.nv} joints: {', '.join(names)}; "
            f"tool {self.tool!r})"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """Be copied as model and state; the memory that compiled code reads stays behind."""
        return type(self), (self.description, self._model), (self.q.copy(), self.v.copy())

    def __setstate__(self, state: tuple[np.ndarray, np.ndarray]) -> None:
        self.update(*state)

    @property
    def q(self) -> np.ndarray:
        """Return the configuration of the last update, (nq,), quaternions normalised."""
        return self._q_view

    @property
    def v(self) -> np.ndarray:
        """Return the velocity of the last update, (nv,)."""
        return self._v_view

    @property
    def M(self) -> np.ndarray:
        """Return the joint-space inertia, (nv, nv), armature included."""
        self.catch_up()
        return self._M_view

    @property
    def bias(self) -> np.ndarray:
        """Return b + g, (nv,) N·m, springs included. Friction is not part of it."""
        self.catch_up()
        return self._bias_view

    @property
    def gravity(self) -> np.ndarray:
        """Return the gravity torque g, (nv,) N·m, without weight that is carried for the robot."""
        return self._cached("gravity", 0, self._gravity)

    def update(self, q: np.ndarray, v: np.ndarray) -> None:
        """Set the state and compute what every query needs.

        Args:
            q: (nq,) configuration; quaternions are normalised.
            v: (nv,) velocity in rad/s (m/s).

        Raises:
            InputError: A wrong shape, a number that is not finite, or a zero quaternion.
        """
        q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        self.check_state(q, v)
        self._q[:] = q
        self._v[:] = v
        for i in self.description.quaternions:
            self._q[i : i + 4] /= math.sqrt(q[i : i + 4] @ q[i : i + 4])
        self._cache.clear()
        self._behind = False
        self._compute()

    def place(self, q: ArrayLike, v: ArrayLike) -> None:
        """Set a state whose numbers are checked elsewhere; the dynamics follow when somebody asks.

        Args:
            q: (nq,) array of float64: the configuration of a robot without quaternions.
            v: (nv,) array of float64: the velocity in rad/s (m/s).

        Raises:
            TypeError: Something else than such an array.
            ValueError: An array of another shape.
        """
        if self._cache:
            self._cache.clear()
        self._behind = True
        # Views of memory compare form and shape faster than NumPy converts them.
        self._q_memory[:] = q  # pyright: ignore[reportArgumentType, reportCallIssue]
        self._v_memory[:] = v  # pyright: ignore[reportArgumentType, reportCallIssue]

    def catch_up(self) -> None:
        """Run the dynamics at the state of the last `place`, unless that has been done."""
        if self._behind:
            self._behind = False
            self._compute()

    @property
    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the arrays that hold q and v, which compiled code reads."""
        return self._q, self._v

    def frame_id(self, name: str) -> int:
        """Return the id of a frame.

        Args:
            name: One of ``frame_names``.

        Returns:
            The id, valid for the life of the robot.

        Raises:
            UnknownNameError: No frame has this name.
        """
        try:
            return self._ids[name]
        except KeyError:
            raise unknown_name(f"frame of {self.name}", name, self.frame_names) from None

    def position(self, frame: int | str) -> np.ndarray:
        """Return the frame's origin in world axes, (3,) m."""
        return self._cached("position", frame, self._position)

    def rotation(self, frame: int | str) -> np.ndarray:
        """Return R_world_frame, (3, 3)."""
        return self._cached("rotation", frame, self._rotation)

    def jacobian(self, frame: int | str) -> np.ndarray:
        """Return J of the frame's origin in world axes, (6, nv), linear rows first."""
        return self._cached("jacobian", frame, self._jacobian)

    def velocity(self, frame: int | str) -> np.ndarray:
        """Return J v, (6,) m/s and rad/s."""
        return self._cached("velocity", frame, lambda f: self.jacobian(f) @ self._v)

    def drift(self, frame: int | str) -> np.ndarray:
        """Return Jdot v, (6,) m/s² and rad/s²."""
        return self._cached("drift", frame, self._drift)

    def com_position(self) -> np.ndarray:
        """Return the centre of mass of the moving links, (3,) m."""
        return self._cached("com", 0, self._com)

    def com_jacobian(self) -> np.ndarray:
        """Return the Jacobian of the centre of mass, (3, nv)."""
        return self._cached("com_jacobian", 0, self._com_jacobian)

    def com_drift(self) -> np.ndarray:
        """Return Jdot v of the centre of mass, (3,) m/s²."""
        return self._cached("com_drift", 0, self._com_drift)

    @abstractmethod
    def fresh(self) -> AdapterBase:
        """Return the same robot with a state of its own; the model is shared."""

    @abstractmethod
    def motion_axes(self) -> MotionAxes | None:
        """Return the arrays that compiled code reads, or None if a joint has several coordinates."""

    @abstractmethod
    def rigid_model(self) -> RigidModel | None:
        """Return the bodies as numbers, or None if there is a joint that they cannot describe."""

    @abstractmethod
    def integrate(self, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        """Return q ⊕ v dt on the configuration manifold, (nq,)."""

    @abstractmethod
    def difference(self, q0: np.ndarray, q1: np.ndarray) -> np.ndarray:
        """Return v, (nv,), such that integrate(q0, v, 1) is q1."""

    @abstractmethod
    def _compute(self) -> None:
        """Run the dynamics at the state just set."""

    @abstractmethod
    def _gravity(self, _: int) -> np.ndarray: ...

    @abstractmethod
    def _position(self, frame: int) -> np.ndarray: ...

    @abstractmethod
    def _rotation(self, frame: int) -> np.ndarray: ...

    @abstractmethod
    def _jacobian(self, frame: int) -> np.ndarray: ...

    @abstractmethod
    def _drift(self, frame: int) -> np.ndarray: ...

    @abstractmethod
    def _com(self, _: int) -> np.ndarray: ...

    @abstractmethod
    def _com_jacobian(self, _: int) -> np.ndarray: ...

    @abstractmethod
    def _com_drift(self, _: int) -> np.ndarray: ...

    def _cached(
        self, what: str, frame: int | str, compute: Callable[[int], np.ndarray]
    ) -> np.ndarray:
        key = (what, frame)
        value = self._cache.get(key)
        if value is None:
            frame = self._known(frame)
            self.catch_up()
            value = compute(frame)
            value.setflags(write=False)
            self._cache[key] = value
        return value

    def _known(self, frame: int | str) -> int:
        """Return the id of a frame that is given by its id or, as people do, by its name.

        Raises:
            InputError: No frame has this id.
            UnknownNameError: No frame has this name.
        """
        if isinstance(frame, str):
            return self.frame_id(frame)
        if not isinstance(frame, int | np.integer) or not 0 <= frame < len(self.frame_names):
            raise InputError(
                f"{self.name} has frames 0 to {len(self.frame_names) - 1}, not {frame!r}: "
                "frame_id(name) gives the id of a name"
            )
        return int(frame)

    def check_state(self, q: np.ndarray, v: np.ndarray) -> None:
        """Check a state.

        Args:
            q: Configuration.
            v: Velocity.

        Raises:
            InputError: A wrong shape, a number that is not finite, or a zero quaternion.
        """
        for name, value, size in (("q", q, self.nq), ("v", v, self.nv)):
            if value.shape != (size,):
                raise InputError(f"{name} of {self.name} has shape {value.shape}, not ({size},)")
        if not (np.isfinite(q).all() and np.isfinite(v).all()):
            self._refuse_non_finite(q, v)
        for i in self.description.quaternions:
            if q[i : i + 4] @ q[i : i + 4] < 1e-12:
                raise InputError(f"q[{i}:{i + 4}] of {self.name} is a quaternion of length zero")

    def _refuse_non_finite(self, q: np.ndarray, v: np.ndarray) -> None:
        if not np.isfinite(v).all():
            j = int(np.flatnonzero(~np.isfinite(v))[0])
            raise InputError(f"velocity of joint {self.joint_names[j]!r} is {v[j]}")
        i = int(np.flatnonzero(~np.isfinite(q))[0])
        raise InputError(f"q[{i}] of {self.name} ({self._coordinate(i)}) is {q[i]}")

    def _coordinate(self, i: int) -> str:
        """Name the joint of configuration coordinate i."""
        before = sum(1 for start in self.description.quaternions if start + 3 <= i)
        return f"joint {self.joint_names[min(i - before, self.nv - 1)]!r}"


def _frozen(array: np.ndarray) -> np.ndarray:
    copy = np.array(array)
    copy.setflags(write=False)
    return copy


def _view(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.setflags(write=False)
    return view


def held_joints(robot: Robot) -> Mapping[str, float | None]:
    """Tell where joints of the file are held that the robot does not control, rad or m."""
    if isinstance(robot, AdapterBase):
        return robot.description.locked
    return dict.fromkeys(robot.locked_joints, 0.0)


def spread_of(robot: Robot) -> Spread | None:
    """Tell how the joints of the file follow those of the robot; None where none follows."""
    return robot.spread if isinstance(robot, AdapterBase) else None
