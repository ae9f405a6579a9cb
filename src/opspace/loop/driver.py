"""What a loop needs of a real robot, and what the robot says about itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from opspace.errors import InputError, unknown_name

WHO = ("robot", "controller")
CLOCKS = ("robot", "computer")
FRICTION = ("robot", "nobody")


class RobotState(NamedTuple):
    """What a robot told at one moment.

    Attributes:
        t: Time, s, of the clock that the driver declares.
        q: (nq,) configuration.
        v: (n,) velocity, rad/s.
        tau: (n,) the last command that the robot has accepted, N·m, as it was commanded; None where
            it does not say. It is not what sensors measure.
        wrenches: What `opspace.Controller.step` takes under that name; None where none are measured.
    """

    t: float
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray | None = None
    wrenches: Mapping[str, np.ndarray | None] | None = None


@dataclass(frozen=True)
class DriverFacts:
    """What a robot does by itself, and what it puts up with.

    Attributes:
        period: Time between two states, s.
        gravity: Who adds the torque that holds the weight, ``"robot"`` or ``"controller"``.
        coriolis: Who adds Coriolis and centrifugal torque, ``"controller"`` or ``"robot"``.
        friction: Who compensates friction, ``"robot"`` or ``"nobody"``.
        torque_rate: The most by which a command may differ from the one accepted before, N·m/s, a
            number or one per joint; None where the robot takes any.
        clock: Whose time states have: ``"robot"`` where it is measured together with the state,
            ``"computer"`` where it is the time of arrival.

    Raises:
        InputError: A period or a rate that cannot be.
        UnknownNameError: Somebody else than those that there are.
    """

    period: float
    gravity: str
    coriolis: str = "controller"
    friction: str = "nobody"
    torque_rate: float | tuple[float, ...] | None = None
    clock: str = "robot"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.period) and self.period > 0.0):
            raise InputError(f"the period must be finite and above 0 s, got {self.period}")
        for what, choices in (
            ("gravity", WHO),
            ("coriolis", WHO),
            ("friction", FRICTION),
            ("clock", CLOCKS),
        ):
            if (who := getattr(self, what)) not in choices:
                raise unknown_name(what, str(who), choices)
        rates = np.atleast_1d(np.asarray(self.torque_rate or (), float))
        if self.torque_rate == 0 or not np.all(rates > 0.0):
            raise InputError(f"a torque rate must be above 0 N·m/s, got {self.torque_rate}")


class Driver(Protocol):
    """A robot that tells its state and takes torques.

    All methods are called by one thread, the loop's.

    Attributes:
        facts: What the robot declares.
    """

    @property
    def facts(self) -> DriverFacts:
        """What the robot does by itself."""
        ...

    def start(self) -> None:
        """Connect, and have the robot take torques; it may hold itself until the first one."""
        ...

    def read(self, timeout: float) -> RobotState | None:
        """Wait for a state that has not been read before, the newest there is.

        Args:
            timeout: For how long, s.

        Returns:
            The state, which nobody changes afterwards; None where none has come.
        """
        ...

    def write(self, tau: np.ndarray) -> None:
        """Command a torque, (n,) N·m, and do not wait for anything."""
        ...

    def stop(self) -> None:
        """Have the robot brake and hold by itself; called at every end, also after errors."""
        ...
