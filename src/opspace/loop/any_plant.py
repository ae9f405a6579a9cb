"""What the loop needs of a robot, simulated or real."""

from __future__ import annotations

from typing import Protocol

import numpy as np


class AnyPlant(Protocol):
    """A robot that is read, and driven by joint torque.

    One that adds the torque against its own weight to every command says so by an attribute
    ``adds_gravity = True``, and one that does not by False; a controller that was built for the other
    kind is then refused. One that measures wrenches has a method ``wrenches()``, which returns what
    `opspace.Controller.step` takes under that name.

    Attributes:
        dt: Time between two ticks, s.
    """

    dt: float

    @property
    def t(self) -> float:
        """Time, s."""
        ...

    @property
    def q(self) -> np.ndarray:
        """Configuration as it is, (nq,)."""
        ...

    @property
    def v(self) -> np.ndarray:
        """Velocity as it is, (n,), rad/s."""
        ...

    def measure(self) -> tuple[np.ndarray, np.ndarray]:
        """Read the sensors: configuration (nq,) and velocity (n,)."""
        ...

    def advance(self, tau: np.ndarray) -> None:
        """Hold a joint torque, (n,) N·m, until the next tick."""
        ...
