"""What both robot adapters share: the state, its checks and the cache of one update."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from weakref import ref

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError, unknown_name
from opspace.robots.description import Description
from opspace.robots.motion_axes import MotionAxes
from opspace.robots.payload import Masses, Payload, moved, tensor_of
from opspace.robots.placement import AddedFrame, FramePlaces, FrameTable, as_placement, skew
from opspace.robots.spread import Spread

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot
    from opspace.robots.rigid_model import RigidModel


class AdapterBase(ABC):
    """A robot whose per-frame quantities are computed on demand and kept until the next update.

    Every array handed out is read-only; ``q``, ``v``, ``M`` and ``bias`` are views that the next
    update overwrites, or the next question after `place`.

    Attributes:
        behind: (1,) not 0 where a state has been set for which the library has computed nothing yet.
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
        self.tool = description.tool
        self.q_reference = _frozen(description.q_reference)
        self.configurations: Mapping[str, np.ndarray] = {
            name: _frozen(q) for name, q in description.configurations.items()
        }
        self.q_lower = _frozen(description.q_lower)
        self.q_upper = _frozen(description.q_upper)
        self.velocity_limit = _frozen(description.velocity_limit)
        self.torque_limit = _frozen(description.torque_limit)
        self.torque_range = _frozen(
            np.stack((-self.torque_limit, self.torque_limit))
            if description.torque_range is None
            else description.torque_range
        )
        self.actuated = _frozen(description.actuated)
        self.floating_base = description.floating_base
        self.locked_joints = tuple(description.locked)
        self.spread: Spread | None = None
        self._table = FrameTable(description.frame_names)
        self._q = np.array(description.q_reference, dtype=float)
        self._v = np.zeros(self.nv)
        self._q_view = _view(self._q)
        self._v_view = _view(self._v)
        # Writing through these takes half the time, and refuses every shape and kind but their own.
        self._q_memory, self._v_memory = self._q.data, self._v.data
        self._cache: dict[tuple[str, int | str], np.ndarray] = {}
        self.behind = np.zeros(1, np.int64)
        self._behind = self.behind.data
        self._payload: Payload | None = None
        self._loads: dict[int, np.ndarray] = {}
        self._read: list[ref[Masses]] = []

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
        given = self.tool, self._table, self._payload, self._loads
        return type(self), self._parts(), (given, self.q.copy(), self.v.copy())

    def _parts(self) -> tuple[Any, ...]:
        """Return what it was made of."""
        return self.description, self._model

    def __setstate__(self, state: tuple[tuple[Any, ...], np.ndarray, np.ndarray]) -> None:
        (self.tool, self._table, self._payload, self._loads), q, v = state
        self.update(q, v)

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Return the names of all frames; the index is the frame's id."""
        return self._table.names

    @property
    def q(self) -> np.ndarray:
        """Return the configuration of the last update, (nq,), quaternions normalised."""
        return self._q_view

    @property
    def v(self) -> np.ndarray:
        """Return the velocity of the last update, (nv,)."""
        return self._v_view

    def _hold(self, M: np.ndarray, bias: np.ndarray) -> None:
        """Keep the memory in which `_compute` leaves inertia and bias."""
        self._M, self._bias = M, bias
        self._M_view, self._bias_view = _view(M), _view(bias)

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
        return self._cached("gravity", 0, self._loaded_gravity)

    @property
    def added_frames(self) -> Mapping[int, AddedFrame]:
        """Return the frames that are not the model's own, by id."""
        return self._table.added

    def add_frame(
        self, name: str, parent: str | None = None, placement: ArrayLike = (0.0, 0.0, 0.0)
    ) -> int:
        """Add a frame of one's own, for tasks, as a tool or to carry a payload.

        It is there for every controller of this robot, also for those that are built already.

        Args:
            name: A name that no frame has yet.
            parent: The frame that it is fixed to; None is the robot's tool.
            placement: Where it is there: (3,) position, m; (7,) position and quaternion
                [x y z, qw qx qy qz]; or a (4, 4) homogeneous matrix.

        Returns:
            Its id.

        Raises:
            InputError: The name is taken, or the placement is none.
            UnknownNameError: No frame is called ``parent``.
        """
        if not isinstance(name, str) or not name:
            raise InputError(f"a frame needs a name, not {name!r}")
        if name in self._table.ids:
            raise InputError(
                f"{self.name} has a frame {name!r} already; give this one another name"
            )
        before = self.frame_id(self.tool if parent is None else parent)
        where = f"the placement of frame {name!r}"
        return self._table.add(name, AddedFrame(before, *as_placement(placement, where)))

    @property
    def payload(self) -> Payload | None:
        """What the robot carries beside its links; set it to change the model at once.

        `opspace.Controller.carry` changes it without a step in the torque.
        """
        return self._payload

    @payload.setter
    def payload(self, payload: Payload | None) -> None:
        self.carry(payload, self.loads_of(payload))

    @property
    def loads(self) -> Mapping[int, np.ndarray]:
        """Return what the frames carry at the moment, by their ids; see `payload.load`."""
        return self._loads

    def loads_of(self, payload: Payload | None) -> dict[int, np.ndarray]:
        """Return what the frames carry with a payload.

        Raises:
            InputError: It is no `Payload`, or hangs on a frame that does not move.
            UnknownNameError: No frame has the name of its frame.
        """
        if payload is None:
            return {}
        if not isinstance(payload, Payload):
            raise InputError(f"a robot carries a Payload or None, not a {type(payload).__name__}")
        name = self.tool if payload.frame is None else payload.frame
        frame, numbers = self.frame_id(name), payload.load
        if not np.any(self.jacobian(frame)):
            raise InputError(f"frame {name!r} of {self.name} does not move and carries no payload")
        added = self._table.added.get(frame)
        if added is not None:
            frame, numbers = added.parent, moved(numbers, added.rotation, added.position)
        return {frame: numbers}

    def carry(self, payload: Payload | None, loads: Mapping[int, np.ndarray]) -> None:
        """Change what the frames carry, for compiled code that reads this robot as well.

        Args:
            payload: What `payload` answers from now on.
            loads: What the frames carry by their ids, (10,) each; it may be on its way to that.
        """
        self._payload, self._loads = payload, dict(loads)
        self._read = [reference for reference in self._read if reference() is not None]
        for reference in self._read:
            masses = reference()
            if masses is not None:
                masses.carry(self._loads)
        self._behind[0] = 1

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
        self._behind[0] = 1
        self.catch_up()

    def place(self, q: ArrayLike, v: ArrayLike) -> None:
        """Set a state whose numbers are checked elsewhere; the dynamics follow when somebody asks.

        Args:
            q: (nq,) array of float64: the configuration of a robot without quaternions.
            v: (nv,) array of float64: the velocity in rad/s (m/s).

        Raises:
            TypeError: Something else than such an array.
            ValueError: An array of another shape.
        """
        self._behind[0] = 1
        # Views of memory compare form and shape faster than NumPy converts them.
        self._q_memory[:] = q  # pyright: ignore[reportArgumentType, reportCallIssue]
        self._v_memory[:] = v  # pyright: ignore[reportArgumentType, reportCallIssue]

    def place_turned(self, q: ArrayLike, v: ArrayLike) -> None:
        """Set a state as `place` does, of a robot with quaternions, which are normalised.

        Raises:
            TypeError: Something else than such an array.
            ValueError: An array of another shape.
            InputError: A quaternion of length zero, or numbers that are not finite.
        """
        self.place(q, v)
        for i in self.description.quaternions:
            w, x, y, z = self._q_memory[i : i + 4]
            length = math.sqrt(w * w + x * x + y * y + z * z)  # which the library in C sums alike
            if not 1e-6 <= length < math.inf:
                self.check_state(self._q, self._v)
            self._q[i : i + 4] /= length

    def catch_up(self) -> None:
        """Run the dynamics at the state of the last `place`, unless that has been done."""
        if self._behind[0]:
            self._behind[0] = 0
            self._cache.clear()
            self._compute()
            for frame, numbers in self._loads.items():
                self._add_load(frame, numbers)

    def _add_load(self, frame: int, numbers: np.ndarray) -> None:
        """Add what a frame carries: M += Jᵀ I J, bias += Jᵀ (I (J̇ v − g) + ω × I ω)."""
        J, drift = self.jacobian(frame), self.drift(frame).copy()
        drift[:3] -= self._links()[1]
        self._M += J.T @ self._load_inertia(frame, numbers) @ J
        self._bias += J.T @ self._load_force(frame, numbers, drift)

    def _load_inertia(self, frame: int, numbers: np.ndarray) -> np.ndarray:
        """Return the inertia (6, 6) of a load in world axes, about the frame's origin."""
        R = self.rotation(frame)
        H, inertia = skew(R @ numbers[1:4]), np.zeros((6, 6))
        inertia[:3, :3] = numbers[0] * np.eye(3)
        inertia[:3, 3:], inertia[3:, :3] = -H, H
        inertia[3:, 3:] = R @ tensor_of(numbers) @ R.T
        return inertia

    def _load_force(self, frame: int, numbers: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        """Return force and moment (6,) that take a load along, at an acceleration (6,) of its frame."""
        inertia = self._load_inertia(frame, numbers)
        spin = skew(self.velocity(frame)[3:])
        force = inertia @ acceleration
        force[:3] += spin @ spin @ self.rotation(frame) @ numbers[1:4]
        force[3:] += spin @ inertia[3:, 3:] @ self.velocity(frame)[3:]
        return force

    def _loaded_gravity(self, _: int) -> np.ndarray:
        g, up = self._gravity(0), np.zeros(6)
        up[:3] = -self._links()[1]
        for frame, numbers in self._loads.items():
            g = g + self.jacobian(frame).T @ self._load_inertia(frame, numbers) @ up
        return g

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
            return self._table.ids[name]
        except (KeyError, TypeError):
            raise unknown_name(f"frame of {self.name}", name, self.frame_names) from None

    def position(self, frame: int | str) -> np.ndarray:
        """Return the frame's origin in world axes, (3,) m."""
        return self._cached("position", frame, self._position, self._added_position)

    def rotation(self, frame: int | str) -> np.ndarray:
        """Return R_world_frame, (3, 3)."""
        return self._cached("rotation", frame, self._rotation, self._added_rotation)

    def jacobian(self, frame: int | str) -> np.ndarray:
        """Return J of the frame's origin in world axes, (6, nv), linear rows first."""
        return self._cached("jacobian", frame, self._jacobian, self._added_jacobian)

    def velocity(self, frame: int | str) -> np.ndarray:
        """Return J v, (6,) m/s and rad/s."""
        return self._cached("velocity", frame, lambda f: self.jacobian(f) @ self._v)

    def drift(self, frame: int | str) -> np.ndarray:
        """Return Jdot v, (6,) m/s² and rad/s²."""
        return self._cached("drift", frame, self._drift, self._added_drift)

    def _added_position(self, added: AddedFrame) -> np.ndarray:
        return self.position(added.parent) + self._arm(added)

    def _added_rotation(self, added: AddedFrame) -> np.ndarray:
        return self.rotation(added.parent) @ added.rotation

    def _added_jacobian(self, added: AddedFrame) -> np.ndarray:
        J = self.jacobian(added.parent).copy()
        J[:3] -= skew(self._arm(added)) @ J[3:]
        return J

    def _added_drift(self, added: AddedFrame) -> np.ndarray:
        r, spin = self._arm(added), skew(self.velocity(added.parent)[3:])
        drift = self.drift(added.parent).copy()
        drift[:3] += spin @ spin @ r - skew(r) @ drift[3:]
        return drift

    def _arm(self, added: AddedFrame) -> np.ndarray:
        """Return the way from the parent's origin to the frame's in world axes, (3,) m."""
        return self.rotation(added.parent) @ added.position

    def com_position(self) -> np.ndarray:
        """Return the centre of mass of the moving links and of what they carry, (3,) m."""
        return self._cached("com", 0, self._loaded_com)

    def com_jacobian(self) -> np.ndarray:
        """Return the Jacobian of the centre of mass, (3, nv)."""
        return self._cached("com_jacobian", 0, self._loaded_com_jacobian)

    def com_drift(self) -> np.ndarray:
        """Return Jdot v of the centre of mass, (3,) m/s²."""
        return self._cached("com_drift", 0, self._loaded_com_drift)

    def _loaded_com(self, _: int) -> np.ndarray:
        return self._with_loads(
            self._com(0),
            lambda f, x: x[0] * self.position(f) + self.rotation(f) @ x[1:4],
        )

    def _loaded_com_jacobian(self, _: int) -> np.ndarray:
        return self._with_loads(
            self._com_jacobian(0),
            lambda f, x: self._load_inertia(f, x)[:3] @ self.jacobian(f),
        )

    def _loaded_com_drift(self, _: int) -> np.ndarray:
        return self._with_loads(
            self._com_drift(0),
            lambda f, x: self._load_force(f, x, self.drift(f))[:3],
        )

    def _with_loads(
        self, links: np.ndarray, carried: Callable[[int, np.ndarray], np.ndarray]
    ) -> np.ndarray:
        """Average something over the mass of the links and of what they carry."""
        if not self._loads:
            return links
        mass, _ = self._links()
        total = mass * links
        for frame, numbers in self._loads.items():
            total = total + carried(frame, numbers)
            mass += numbers[0]
        return total / mass

    def fresh(self) -> AdapterBase:
        """Return the same robot with a state of its own; the model is shared."""
        copy = self._fresh()
        copy.tool, copy._table = self.tool, self._table
        copy._payload, copy._loads = self._payload, dict(self._loads)
        copy._behind[0] = bool(self._loads)
        return copy

    def motion_axes(self) -> MotionAxes | None:
        """Return the arrays that compiled code reads, or None if a joint has several coordinates."""
        found = self._motion_axes()
        return None if found is None else replace(found, frames=self._followed(found))

    def rigid_model(self) -> RigidModel | None:
        """Return the bodies as numbers, or None if there is a joint that they cannot describe."""
        found = self._rigid_model()
        return None if found is None else replace(found, frames=self._followed(found))

    def _followed(self, found: MotionAxes | RigidModel) -> FramePlaces:
        """Let numbers that somebody else reads follow the payload and the frames that are added."""
        found.masses.carry(self._loads)
        self._read.append(ref(found.masses))
        return FramePlaces(found.frames, self._table.added)

    @abstractmethod
    def _fresh(self) -> AdapterBase:
        """Return a robot of the same model, as it was loaded."""

    @abstractmethod
    def _motion_axes(self) -> MotionAxes | None:
        """Return the arrays of the model as it was loaded; see `motion_axes`."""

    @abstractmethod
    def _rigid_model(self) -> RigidModel | None:
        """Return the bodies of the model as it was loaded; see `rigid_model`."""

    @abstractmethod
    def _links(self) -> tuple[float, np.ndarray]:
        """Return the mass of the moving links, kg, and gravity (3,), m/s²."""

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
        self,
        what: str,
        frame: int | str,
        compute: Callable[[int], np.ndarray],
        of_added: Callable[[AddedFrame], np.ndarray] | None = None,
    ) -> np.ndarray:
        self.catch_up()
        key = (what, frame)
        value = self._cache.get(key)
        if value is None:
            frame = self._known(frame)
            added = self._table.added.get(frame) if of_added is not None else None
            value = compute(frame) if of_added is None or added is None else of_added(added)
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

    def _without_coordinates(self) -> str:
        """Name the joints of the file that have none."""
        following = [one.follower for one in self.description.couplings]
        reasons = {"held": list(self.description.locked), "following others": following}
        told = [f"{', '.join(names)} ({why})" for why, names in reasons.items() if names]
        return f"; without coordinates: {', '.join(told)}" if told else ""

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
                raise InputError(
                    f"{name} of {self.name} has shape {value.shape}, not ({size},)"
                    + self._without_coordinates()
                )
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


def added_armature(robot: Robot) -> float:
    """Tell the inertia of motors that a URDF was read with, kg·m² or kg."""
    return robot.description.armature if isinstance(robot, AdapterBase) else 0.0


def spread_of(robot: Robot) -> Spread | None:
    """Tell how the joints of the file follow those of the robot; None where none follows."""
    return robot.spread if isinstance(robot, AdapterBase) else None


def added_frames(robot: Robot) -> dict[str, dict[str, Any]]:
    """Tell which frames a robot was given, by name: parent, and placement as (4, 4) lists."""
    if not isinstance(robot, AdapterBase):
        return {}
    names, found = robot.frame_names, {}
    for frame, added in robot.added_frames.items():
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = added.rotation, added.position
        found[names[frame]] = {"parent": names[added.parent], "placement": T.tolist()}
    return found
