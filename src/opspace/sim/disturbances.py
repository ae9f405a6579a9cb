"""What a real robot does and its model does not: wrong masses, friction, delay, noise, pushes."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from opspace.errors import InputError

if TYPE_CHECKING:
    from opspace.robots.protocol import Robot

STIFF = 0.9999
"""How much of the load dry friction takes before its limit, MuJoCo's impedance."""


@dataclass(frozen=True)
class Push:
    """A constant force for some time.

    Attributes:
        at: When it begins, s.
        duration: How long it lasts, s.
        force: (3,) N, in world axes.
        frame: Name of the frame that is pushed; None is the tool.
    """

    at: float
    duration: float
    force: Sequence[float]
    frame: str | None = None

    def __post_init__(self) -> None:
        force = np.asarray(self.force, dtype=float)
        if force.shape != (3,) or not np.all(np.isfinite(force)):
            raise InputError(f"the force of a push must be 3 finite numbers [N], got {self.force}")
        if not (math.isfinite(self.at) and math.isfinite(self.duration) and self.duration > 0.0):
            raise InputError(f"a push needs a time and a duration above 0 s, got {self}")


@dataclass(frozen=True)
class Disturbances:
    """What is wrong with the model, the sensors and the world; nothing by default.

    Attributes:
        mass_error: Mass and inertia of every link are off by a factor of 1 ± up to this, each its own.
        dry_friction: Dry friction of every joint as a part of its torque limit, beside the model's.
        delay: How long a torque takes to reach the joints, s; rounded to whole ticks.
        position_noise: Standard deviation of every measured joint position, rad or m.
        velocity_noise: Standard deviation of every measured joint velocity, rad/s or m/s.
        pushes: Forces on the tool.
        wrench_noise: Standard deviation of every measured force, N; a hundredth of it N·m.
        wrench_delay: How long a wrench takes to be measured, s; rounded to whole ticks.
        seed: What the random numbers come from; the same seed gives the same robot and noise.
    """

    mass_error: float = 0.0
    dry_friction: float = 0.0
    delay: float = 0.0
    position_noise: float = 0.0
    velocity_noise: float = 0.0
    pushes: Sequence[Push] = ()
    wrench_noise: float = 0.0
    wrench_delay: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        names = (
            "mass_error",
            "dry_friction",
            "delay",
            "position_noise",
            "velocity_noise",
            "wrench_noise",
            "wrench_delay",
        )
        for name in names:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise InputError(f"{name} must be finite and >= 0, got {value}")
        if self.mass_error >= 1.0:
            raise InputError(f"mass_error must be below 1, got {self.mass_error}")

    def spoil(self, model: Any, torque_limit: np.ndarray) -> None:
        """Change masses and friction of a MuJoCo model; derived constants are left to the caller.

        Args:
            model: The model; no other plant may share it.
            torque_limit: (n,) N·m.

        Raises:
            InputError: Friction is asked for and a joint's torque limit is not known.
        """
        if self.mass_error:
            rng = self._stream(0)
            factor = 1.0 + rng.uniform(-self.mass_error, self.mass_error, model.nbody)
            model.body_mass[:] *= factor
            model.body_inertia[:] *= factor[:, None]
        if self.dry_friction:
            if not np.all(np.isfinite(torque_limit)):
                raise InputError("dry_friction is a part of the torque limit, which is not known")
            model.dof_frictionloss[:] += self.dry_friction * torque_limit
            # MuJoCo's usual friction creeps under a load; this one holds.
            model.dof_solimp[:, :2] = STIFF
            model.dof_solref[:] = (2.0 * model.opt.timestep, 1.0)

    def sensors(self) -> Sensors:
        """Build the sensors of a run."""
        return Sensors(self.position_noise, self.velocity_noise, self._stream(1))

    def wrist(self, dt: float) -> Wrist:
        """Build the wrench sensor of a run with ticks of ``dt`` [s]."""
        return Wrist(self.wrench_noise, round(self.wrench_delay / dt), self._stream(2))

    def _stream(self, number: int) -> np.random.Generator:
        # A stream for each purpose: noise stays what it is when masses are no longer drawn.
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(number,)))


NO_DISTURBANCES = Disturbances()


class Sensors:
    """Adds noise to what is measured.

    Args:
        position: Standard deviation, rad or m.
        velocity: Standard deviation, rad/s or m/s.
        rng: Where the noise comes from.
    """

    def __init__(self, position: float, velocity: float, rng: np.random.Generator) -> None:
        self._position, self._velocity, self._rng = position, velocity, rng

    @property
    def noisy(self) -> bool:
        """Whether measured and true states differ."""
        return self._position > 0.0 or self._velocity > 0.0

    def read(self, robot: Robot, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Measure a state.

        Args:
            robot: The robot, for its configuration manifold.
            q: (nq,) true configuration.
            v: (n,) true velocity, rad/s.

        Returns:
            Measured configuration and velocity.
        """
        if not self.noisy:
            return q, v
        wrong = self._position * self._rng.standard_normal(v.size)
        return robot.integrate(q, wrong, 1.0), v + self._velocity * self._rng.standard_normal(
            v.size
        )


class Wrist:
    """Measures a wrench late and with noise.

    Args:
        noise: Standard deviation of a force, N; a hundredth of it is that of a moment, N·m.
        ticks: How many ticks late.
        rng: Where the noise comes from.
    """

    def __init__(self, noise: float, ticks: int, rng: np.random.Generator) -> None:
        self._noise = noise * np.array([1.0, 1.0, 1.0, 0.01, 0.01, 0.01])
        self._wire, self._rng = Wire(ticks), rng

    def read(self, wrench: np.ndarray) -> np.ndarray:
        """Put in the wrench that there is, (6,) N and N·m, and take out what is measured of it."""
        late = self._wire.send(wrench)
        if not np.any(self._noise):
            return np.array(late)
        return late + self._noise * self._rng.standard_normal(6)


class Wire:
    """Hands torques on some ticks late; until the first arrives, the first one counts as arrived.

    Args:
        ticks: How many ticks late.
    """

    def __init__(self, ticks: int) -> None:
        self._waiting: deque[np.ndarray] = deque()
        self._ticks = ticks

    def send(self, tau: np.ndarray) -> np.ndarray:
        """Put a torque in and take out the one that arrives now."""
        if self._ticks == 0:
            return tau
        if not self._waiting:
            self._waiting.extend([tau] * self._ticks)
        self._waiting.append(np.array(tau))
        return self._waiting.popleft()


class Hand:
    """Pushes the robot.

    Args:
        robot: The robot that is pushed; it is left alone.
        pushes: When, where, how long and how hard.

    Raises:
        UnknownNameError: The robot has no frame of this name.
    """

    def __init__(self, robot: Robot, pushes: Sequence[Push]) -> None:
        self._pushes = tuple((push, robot.frame_id(push.frame or robot.tool)) for push in pushes)
        self._robot = robot.fresh() if self._pushes else robot

    def torque(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray | None:
        """Return Jᵀ F of the pushes that last at time t, (n,) N·m; None where there is none."""
        now = [(p.force, id_) for p, id_ in self._pushes if p.at <= t < p.at + p.duration]
        if not now:
            return None
        self._robot.update(q, v)
        frames = dict.fromkeys(id_ for _, id_ in now)
        total = np.zeros(v.size)
        for frame in frames:
            force = np.sum([force for force, id_ in now if id_ == frame], axis=0)
            total += self._robot.jacobian(frame)[:3].T @ force
        return total
