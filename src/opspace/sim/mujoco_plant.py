"""The simulated robot: MuJoCo, driven by joint torque."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from opspace.errors import InputError, ModelError, missing_extra
from opspace.robots.adapter import spread_of
from opspace.robots.joint_units import joint_units
from opspace.robots.motor_range import motor_range
from opspace.sim.disturbances import NO_DISTURBANCES, Disturbances, Hand, Wire
from opspace.sim.ground import Ground
from opspace.sim.held_load import add_loads, loads_by_frame
from opspace.sim.hole import Hole
from opspace.sim.surfaces import Surface, TouchedWorld

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot


def _import_mujoco() -> Any:
    try:
        import mujoco  # noqa: PLC0415 - an extra, and slow to import
    except ImportError:
        raise missing_extra("mujoco", "sim") from None
    return mujoco


FINEST = 2.5e-4
"""Steps in which a stiff surface is simulated, s."""


class Plant:
    """A robot in MuJoCo with nothing between the command and its joints but what is asked for.

    Args:
        robot: The robot whose file is simulated, with what it carries when the plant is made.
        q: Configuration at the start, (nq,).
        v: Velocity at the start, (n,), rad/s; zero where not given.
        dt: Time step, s.
        friction: Simulate the joint friction that the model has; the controller does not know it.
        torque_limits: Saturate the torque at the robot's limits.
        adds_gravity: Add the torque that holds the weight to every command, as robots do whose
            drivers are told the rest only; see ``gravity`` of `opspace.Controller`.
        disturbances: What the controller's model does not know.
        ground: What a robot with a floating base stands on; None is nothing.
        surfaces: What the tool may touch; the wrench there is measured.
        holes: Holes that a peg on the tool may be put into; the wrench there is measured.
        substeps: Steps of the simulation in each time step; None is 1, or where something may be
            touched as many as make them at most 0.25 ms.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        ModelError: The robot has no file, or MuJoCo cannot simulate it.
        InputError: The start state or a disturbance does not fit the robot.
    """

    def __init__(
        self,
        robot: Robot,
        q: np.ndarray,
        v: np.ndarray | None = None,
        *,
        dt: float = 0.001,
        friction: bool = False,
        torque_limits: bool = True,
        adds_gravity: bool = False,
        disturbances: Disturbances = NO_DISTURBANCES,
        ground: Ground | None = None,
        surfaces: Sequence[Surface] = (),
        holes: Sequence[Hole] = (),
        substeps: int | None = None,
    ) -> None:
        if not (math.isfinite(dt) and dt > 0.0):
            raise InputError(f"the time step must be above 0 s, got {dt}")
        self._substeps = _checked_substeps(substeps, dt, bool(surfaces or holes))
        mujoco = _import_mujoco()
        from opspace.robots.mujoco_model import model_of  # noqa: PLC0415 - imports mujoco

        if robot.source is None:
            raise ModelError(f"robot {robot.name!r} has no file that a simulator could load")
        self._mujoco = mujoco
        self.model = model_of(robot, partial(_extend, loads_by_frame(robot), ground))
        self.model.opt.timestep = dt / self._substeps
        self._ground = ground
        # Implicit in the velocity: stable for stiff friction, exact for a frictionless arm to O(dt).
        self.model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        # Joint ranges are the controller's job, and a stop or a contact would hide its failures.
        if ground is None:
            self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
        self.model.opt.disableflags |= (
            mujoco.mjtDisableBit.mjDSBL_LIMIT
            | mujoco.mjtDisableBit.mjDSBL_ACTUATION
            # A run that diverges must be seen to diverge, not start again from the beginning.
            | mujoco.mjtDisableBit.mjDSBL_AUTORESET
        )
        if not friction:
            self.model.dof_damping[:] = 0.0
            self.model.dof_frictionloss[:] = 0.0
        spread = self._spread = spread_of(robot)
        # A floating base has no motor that a command could reach.
        limit = motors = np.where(robot.actuated, robot.torque_limit, 0.0)
        if spread is not None:
            limit = np.zeros(self.model.nv)
            limit[spread.leaders] = motors
        disturbances.spoil(self.model, limit)
        given = motor_range(robot)
        ends = (given.least, given.most) if torque_limits else (-np.inf, np.inf)
        self._ends = tuple(np.where(robot.actuated, end, 0.0) for end in ends)
        self._robot = robot
        self.adds_gravity = adds_gravity
        self._own_model = robot.fresh() if adds_gravity else None
        self._wire = Wire(round(disturbances.delay / dt))
        self._hand = Hand(robot, disturbances.pushes)
        self._sensors = disturbances.sensors()
        self._world = TouchedWorld(robot, surfaces, holes)
        self._wrist = disturbances.wrist(dt)
        self.data = mujoco.MjData(self.model)
        if disturbances.mass_error:
            mujoco.mj_setConst(self.model, self.data)
        start = np.asarray(q, dtype=float)
        if start.shape != (robot.nq,) or not np.all(np.isfinite(start)):
            raise InputError(
                f"the start configuration of {robot.name!r} must be {robot.nq} finite numbers"
            )
        self.data.qpos[:] = start if spread is None else spread.positions(start)
        if v is not None:
            speed = np.asarray(v, dtype=float)
            if speed.shape != (robot.nv,) or not np.all(np.isfinite(speed)):
                raise InputError(
                    f"the start velocity of {robot.name!r} must be {robot.nv} finite numbers"
                )
            self.data.qvel[:] = speed if spread is None else spread.G @ speed
        self._lay_boards()
        mujoco.mj_forward(self.model, self.data)
        self.dt = dt

    def __repr__(self) -> str:
        speeds = np.abs(self.v)
        fastest = int(np.argmax(speeds))
        return (
            f"Plant({self._robot.name!r}, t={self.t:g} s, dt={self.dt:g} s, "
            f"fastest joint {speeds[fastest]:.3g} {joint_units(self._robot)[fastest]}/s)"
        )

    def __getstate__(self) -> dict[str, Any]:
        """Be copied with model and state; a module is not what can be."""
        return {name: value for name, value in self.__dict__.items() if name != "_mujoco"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, _mujoco=_import_mujoco())

    @property
    def t(self) -> float:
        """Simulated time, s."""
        return float(self.data.time)

    @property
    def q(self) -> np.ndarray:
        """Configuration, (nq,), a copy."""
        return np.array(self._own(self.data.qpos))

    @property
    def v(self) -> np.ndarray:
        """Velocity, (n,), rad/s, a copy."""
        return np.array(self._own(self.data.qvel))

    @property
    def noisy(self) -> bool:
        """Whether what is measured differs from the state."""
        return self._sensors.noisy

    def measure(self) -> tuple[np.ndarray, np.ndarray]:
        """Read the sensors: configuration (nq,) and velocity (n,), with their noise."""
        return self._sensors.read(self._robot, self.q, self.v)

    def advance(self, tau: np.ndarray) -> None:
        """Hold a joint torque for one time step.

        Args:
            tau: (n,) N·m.
        """
        self._lay_boards()
        asked = self._wire.send(tau)
        if self._own_model is not None:
            self._own_model.update(self.q, self.v)
            asked = asked + self._own_model.gravity
        applied = np.clip(asked, *self._ends)
        push = self._hand.torque(self.t, self._own(self.data.qpos), self._own(self.data.qvel))
        given = applied if push is None else applied + push
        if self._world:
            for _ in range(self._substeps):
                self._step(
                    given + self._world.torque(self._own(self.data.qpos), self._own(self.data.qvel))
                )
        else:
            self._step(given, self._substeps)

    def wrenches(self) -> dict[str, np.ndarray]:
        """Measure the wrench of the tool on what it touches, as `opspace.Controller.step` takes it.

        Returns:
            (6,) N and N·m in world axes, by name of the tool; nothing where nothing may be touched.
        """
        if not self._world:
            return {}
        self._world.torque(self.q, self.v)
        return {self._world.name: self._wrist.read(self._world.wrench)}

    @property
    def holes(self) -> tuple[Hole, ...]:
        """The holes that there are."""
        return self._world.holes

    @property
    def exerted(self) -> np.ndarray:
        """Wrench of the tool on what it touches as it is, (6,) N and N·m in world axes."""
        if self._world:
            self._world.torque(self.q, self.v)
        return self._world.wrench.copy()

    def _step(self, given: np.ndarray, count: int = 1) -> None:
        if self._spread is None:
            self.data.qfrc_applied[:] = given
        else:
            self.data.qfrc_applied[self._spread.leaders] = given
        self._mujoco.mj_step(self.model, self.data, nstep=count)

    @property
    def contact_forces(self) -> dict[str, np.ndarray]:
        """What presses on each contact of the ground, (3,) N on the robot in world axes, by name."""
        return {} if self._ground is None else self._ground.forces(self.model, self.data)

    def _lay_boards(self) -> None:
        if self._ground is not None and self._ground.boards:
            self._ground.lay_boards(self.model, self.t)

    def _own(self, values: np.ndarray) -> np.ndarray:
        """Leave the joints that lead; those that follow belong to the simulation."""
        return values if self._spread is None else values[self._spread.leaders]


def _extend(loads: Mapping[str, np.ndarray], ground: Ground | None, spec: Any) -> None:
    """Add what the file of the robot has not."""
    add_loads(spec, loads)
    if ground is not None:
        ground.add_to(spec)


def _checked_substeps(substeps: int | None, dt: float, touching: bool) -> int:
    if substeps is None:
        return math.ceil(dt / FINEST - 1e-9) if touching else 1
    if substeps < 1:
        raise InputError(f"a time step has at least one step of the simulation, not {substeps}")
    return substeps
