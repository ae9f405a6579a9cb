"""Arms of Universal Robots (e-Series, UR20 and later) through `ur_rtde`."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from opspace.errors import InputError, RobotStoppedError, missing_extra
from opspace.loop.driver import DriverFacts, RobotState

JOINTS = 6
PERIOD = 2e-3
LOOK_AGAIN = 5e-5
"""How long after a look for a new state the next one is, s."""
VISCOUS = (0.9, 0.9, 0.8, 0.9, 0.9, 0.9)
COULOMB = (0.8, 0.8, 0.7, 0.8, 0.8, 0.8)
"""Parts of the friction model that the robot adds unless told otherwise."""


def _import_ur_rtde() -> tuple[Any, Any]:
    try:
        import rtde_control  # noqa: PLC0415 - an extra  # pyright: ignore[reportMissingImports]
        import rtde_receive  # noqa: PLC0415  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise missing_extra("ur_rtde", "ur") from None
    return rtde_control.RTDEControlInterface, rtde_receive.RTDEReceiveInterface


class UrDriver:
    """An arm of Universal Robots, driven by torque at 500 Hz (PolyScope 5.23 or 10.10 and later).

    The robot adds gravity, so that zero torque holds, and as much of its friction model as it is told
    to. It does not tell which command it has accepted. It must be in remote control; while the driver
    is connected a program of its own runs there, and the end of that program is a stop.

    Args:
        host: Address of the robot.
        viscous: (6,) parts, 0 to 1, of viscous friction that the robot compensates.
        coulomb: (6,) parts, 0 to 1, of dry friction that the robot compensates.

    Raises:
        MissingExtraError: `ur_rtde` is not installed.
        InputError: Parts that are none.
    """

    def __init__(
        self, host: str, *, viscous: Sequence[float] = VISCOUS, coulomb: Sequence[float] = COULOMB
    ) -> None:
        parts = [np.asarray(given, float) for given in (viscous, coulomb)]
        if not all(one.shape == (JOINTS,) and np.all((one >= 0) & (one <= 1)) for one in parts):
            raise InputError(
                f"six parts from 0 to 1 each, got viscous={viscous}, coulomb={coulomb}"
            )
        self._kinds = _import_ur_rtde()
        friction = "robot" if np.any(np.concatenate(parts)) else "nobody"
        self.facts = DriverFacts(PERIOD, gravity="robot", friction=friction, clock="robot")
        self._host = host
        self._friction = [one.tolist() for one in parts]
        self._control: Any = None
        self._receive: Any = None
        self._seen: float | None = None

    def start(self) -> None:
        """Connect, and start the program that takes torques.

        Raises:
            RobotStoppedError: The robot does not let anybody: it is off, stopped, or not in remote
                control.
        """
        control, receive = self._kinds
        with self._told():
            self._receive = receive(self._host, 1.0 / PERIOD)
            self._control = control(self._host, 1.0 / PERIOD)
        self._seen = None

    def read(self, timeout: float) -> RobotState | None:
        """Wait for a state that is newer than the last one.

        Raises:
            RobotStoppedError: The robot has stopped, and why.
        """
        end = time.perf_counter() + timeout
        with self._told():
            while (t := self._receive.getTimestamp()) == self._seen:
                self._check()
                if time.perf_counter() >= end:
                    return None
                time.sleep(LOOK_AGAIN)
            q, v = self._receive.getActualQ(), self._receive.getActualQd()
        self._seen = t
        return RobotState(t, np.array(q), np.array(v))

    def write(self, tau: np.ndarray) -> None:
        """Command a torque.

        Raises:
            RobotStoppedError: The robot does not take it.
        """
        with self._told():
            taken = self._control.directTorque(tau.tolist(), *self._friction)
        if not taken:
            raise RobotStoppedError(f"the arm at {self._host} does not take torques any more")

    def stop(self) -> None:
        """End the program; the robot holds itself."""
        control, self._control = self._control, None
        receive, self._receive = self._receive, None
        ends: list[Callable[[], object]] = []
        if control is not None:
            ends += [control.stopScript, control.disconnect]
        if receive is not None:
            ends += [receive.disconnect]
        for end in ends:
            # Where it has gone by itself there is nothing to end.
            with contextlib.suppress(RuntimeError):
                end()

    def _check(self) -> None:
        """Tell why the robot has stopped, if it has."""
        receive = self._receive
        for stopped, why in (
            (receive.isEmergencyStopped, "emergency stop"),
            (receive.isProtectiveStopped, "protective stop"),
        ):
            if stopped():
                raise RobotStoppedError(f"the arm at {self._host} is in {why}")
        if not receive.isConnected():
            raise RobotStoppedError(f"the arm at {self._host} has left the network")

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Say in one way what the library says in many."""
        try:
            yield
        except RuntimeError as error:
            raise RobotStoppedError(f"the arm at {self._host}: {error}") from error
