"""Franka arms (FR3, Panda) through `pylibfranka`, the manufacturer's client."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from opspace.errors import InputError, RobotStoppedError, missing_extra
from opspace.loop.driver import DriverFacts, RobotState

JOINTS = 7
PERIOD = 1e-3
TORQUE_RATE = 1000.0
"""What the robot takes between two commands; more is the reflex ``controller_torque_discontinuity``."""


Felt = Callable[[np.ndarray, np.ndarray], Mapping[str, np.ndarray]]
"""Makes the wrenches of a tick of q (n,) and external torques (n,)."""


def _import_pylibfranka() -> Any:
    try:
        import pylibfranka  # noqa: PLC0415 - an extra  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise missing_extra("pylibfranka", "franka") from None
    return pylibfranka


class FrankaDriver:
    """A Franka arm, driven by torque at 1 kHz.

    The robot adds gravity and compensates friction; the command is what is left, Coriolis torque
    included. It takes 1000 N·m/s between commands, keeps the last one for a packet that is lost, and
    stops after 20 in a row. What it accepted last comes back as ``tau_J_d``, which is what the next
    command is compared with. What hangs on the flange is told to the robot (`set_load`, or Desk) for
    gravity, and to the model for inertia.

    Args:
        host: Address of the robot.
        real_time: Refuse to start without a real-time kernel, as the client does by itself.
        collision: Torque, N·m, and force, N, beyond which the robot stops; None leaves what it has.
        felt: Makes wrenches of q and the robot's estimate of the external torques,
            ``tau_ext_hat_filtered``, for force tasks: `opspace.JointTorqueSensor.wrenches`, or what
            negates them first where pressing shows the other sign. None is no wrench.

    Raises:
        MissingExtraError: `pylibfranka` is not installed.
        InputError: A threshold that is none.
    """

    facts = DriverFacts(
        PERIOD, gravity="robot", friction="robot", torque_rate=TORQUE_RATE, clock="robot"
    )

    def __init__(
        self,
        host: str,
        *,
        real_time: bool = True,
        collision: tuple[float, float] | None = None,
        felt: Felt | None = None,
    ) -> None:
        if collision is not None and not all(0.0 < most < np.inf for most in collision):
            raise InputError(f"collision thresholds must be above 0, got {collision}")
        self._library = _import_pylibfranka()
        self._host, self._real_time, self._collision = host, real_time, collision
        self._felt = felt
        self._robot: Any = None
        self._control: Any = None
        self._ended = ""

    def start(self) -> None:
        """Connect, and begin to command torques.

        Raises:
            RobotStoppedError: The robot does not let anybody: it is locked, in user stop or in error.
        """
        kinds = self._library.RealtimeConfig
        config = kinds.kEnforce if self._real_time else kinds.kIgnore
        self._ended = ""
        with self._told():
            self._robot = self._library.Robot(self._host, config)
            if self._collision is not None:
                torque, force = [self._collision[0]] * JOINTS, [self._collision[1]] * 6
                self._robot.set_collision_behavior(torque, torque, force, force)
            self._control = self._robot.start_torque_control()

    def read(self, timeout: float) -> RobotState | None:
        """Wait for the next state; the client gives up by itself where none comes.

        Raises:
            RobotStoppedError: The robot has stopped, and why.
        """
        del timeout
        with self._moving():
            state, _ = self._control.readOnce()
        q, wrenches = np.array(state.q), None
        if self._felt is not None:
            wrenches = self._felt(q, np.array(state.tau_ext_hat_filtered))
        return RobotState(
            state.time.to_sec(), q, np.array(state.dq), np.array(state.tau_J_d), wrenches
        )

    def write(self, tau: np.ndarray) -> None:
        """Command a torque.

        Raises:
            RobotStoppedError: The robot has stopped, and why.
        """
        with self._moving():
            self._control.writeOnce(self._library.Torques(tau.tolist()))

    def stop(self) -> None:
        """End the motion; the robot holds itself, and closes its brakes when it is told to."""
        control, self._control = self._control, None
        if control is not None and not self._ended:
            last = self._library.Torques([0.0] * JOINTS)
            last.motion_finished = True
            # Where it has stopped by itself there is nothing to end.
            with contextlib.suppress(self._library.FrankaException, RuntimeError):
                control.writeOnce(last)
        del control
        robot, self._robot = self._robot, None
        if robot is not None:
            with contextlib.suppress(self._library.FrankaException, RuntimeError):
                robot.stop()

    @contextlib.contextmanager
    def _moving(self) -> Iterator[None]:
        """Use a motion that goes on: asked about one that has ended, the client waits for ever."""
        if self._ended:
            raise RobotStoppedError(self._ended)
        try:
            with self._told():
                yield
        except RobotStoppedError as error:
            self._ended = str(error)
            raise

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Say in one way what the client says in many."""
        try:
            yield
        except (self._library.FrankaException, RuntimeError) as error:
            raise RobotStoppedError(f"the Franka arm at {self._host}: {error}") from error
