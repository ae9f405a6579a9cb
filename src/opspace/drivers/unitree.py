"""Unitree's humanoids (G1, H1-2) through DDS: the driver, and the robot's side of it."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from opspace.drivers.unitree_messages import MOTORS, CommandBytes, StateBytes, messages
from opspace.errors import InputError, RobotStoppedError, unknown_name
from opspace.loop.driver import DriverFacts, RobotState
from opspace.tasks.validation import positive

G1_MOTORS = tuple(
    f"{name}_joint"
    for name in (
        *(
            f"{side}_{joint}"
            for side in ("left", "right")
            for joint in ("hip_pitch", "hip_roll", "hip_yaw", "knee", "ankle_pitch", "ankle_roll")
        ),
        *("waist_yaw", "waist_roll", "waist_pitch"),
        *(
            f"{side}_{joint}"
            for side in ("left", "right")
            for joint in (
                *("shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow"),
                *("wrist_roll", "wrist_pitch", "wrist_yaw"),
            )
        ),
    )
)
"""Motors of a G1 with 29 joints in their order."""

STATE, COMMAND = "rt/lowstate", "rt/lowcmd"
"""What the two messages are called."""
DISCOVERY = 1.0
"""How long it may take to learn who else is there, s."""
FAREWELLS = 5
"""A request to brake is sent so often: any one may be lost."""
MILLISECOND = 1e-3
LOOPBACK = "lo"


class UnitreeDriver:
    """A humanoid of Unitree, driven by torque through its low-level commands.

    Some joints are driven by the controller, stiffness and damping of their motors at zero; the
    others are held by their motors where they are at the first state. What the robot's own computer
    does about balance must be off (debug mode), and the robot hang or stand on something: the base
    is not among what is driven, so that the model has a fixed base or the trunk is held. The robot
    compensates nothing. It does not tell which command it has accepted, and what it does when commands
    stay away depends on its firmware: try that while it hangs.

    Args:
        motors: Names of all motors of the robot in their order, such as `G1_MOTORS`.
        joints: Those that the controller drives, in the order of its model: ``robot.joint_names``.
        period: Time between two states, s.
        hold: Stiffness, N·m/rad, and damping, N·m·s/rad, with which motors hold the other joints.
        brake: Damping of all motors at the end, N·m·s/rad.
        interface: Network interface to the robot; None leaves it to the library and its
            ``CYCLONEDDS_URI``.
        domain: Number of the DDS domain.

    Raises:
        MissingExtraError: `cyclonedds` is not installed.
        InputError: A number that cannot be, too many motors, or a joint twice.
        UnknownNameError: No motor is named so.
    """

    def __init__(
        self,
        motors: Sequence[str],
        joints: Sequence[str],
        *,
        period: float = 2e-3,
        hold: tuple[float, float] = (60.0, 2.0),
        brake: float = 8.0,
        interface: str | None = None,
        domain: int = 0,
    ) -> None:
        messages()
        if not 0 < len(motors) <= MOTORS:
            raise InputError(f"a message has room for 1 to {MOTORS} motors, got {len(motors)}")
        for name in joints:
            if name not in motors:
                raise unknown_name("motor", name, motors)
        if len(set(joints)) != len(joints) or not joints:
            raise InputError(f"joints must be some, each of them once, got {list(joints)}")
        if not all(0.0 <= gain < math.inf for gain in hold):
            raise InputError(f"stiffness and damping must be finite and >= 0, got {hold}")
        self.facts = DriverFacts(period, gravity="controller", clock="robot")
        self._all = np.arange(len(motors))
        self._driven = np.array([list(motors).index(name) for name in joints])
        self._others = np.setdiff1d(self._all, self._driven)
        self._hold, self._brake = hold, positive(brake, "brake")
        self._where = interface, domain
        self._wire: _Wire | None = None
        self._command: CommandBytes | None = None
        self._t = 0.0
        self._tick: int | None = None

    def start(self) -> None:
        """Join the robot's network.

        Raises:
            RobotStoppedError: Somebody else commands the motors.
        """
        types = messages()
        self._command = self._tick = None
        self._wire = _Wire(self._where, (STATE, types.state), (COMMAND, types.command))
        if not self._wire.alone(COMMAND):
            self._wire.close()
            self._wire = None
            raise RobotStoppedError(
                f"somebody else sends {COMMAND}: take the robot to debug mode and end other programs"
            )

    def read(self, timeout: float) -> RobotState | None:
        """Wait for a state; of several that wait the newest is taken."""
        assert self._wire is not None
        body = self._wire.newest(timeout)
        if body is None:
            return None
        state = StateBytes(body)
        tick = state.tick
        passed = tick if self._tick is None else (tick - self._tick) % 2**32
        self._t = passed * MILLISECOND + (0.0 if self._tick is None else self._t)
        self._tick = tick
        if self._command is None:
            self._command = self._held(state)
        motors = state.motors[self._driven]
        return RobotState(self._t, motors["q"].astype(float), motors["dq"].astype(float))

    def write(self, tau: np.ndarray) -> None:
        """Command a torque."""
        assert self._command is not None
        self._command.motors["tau"][self._driven] = tau
        self._send()

    def stop(self) -> None:
        """Have all motors brake by their damping, which stays when nothing more is sent."""
        if self._wire is None:
            return
        if self._command is not None:
            for name, value in (("tau", 0.0), ("kp", 0.0), ("kd", self._brake)):
                self._command.motors[name][self._all] = value
            for _ in range(FAREWELLS):
                self._send()
                time.sleep(self.facts.period)
        self._wire.close()
        self._wire = None

    def _held(self, state: StateBytes) -> CommandBytes:
        """Begin with a command that holds everything that is not driven."""
        command = CommandBytes()
        command.enable(self._all, state.mode_machine)
        motors = command.motors
        motors["q"][self._others] = state.motors["q"][self._others]
        motors["kp"][self._others], motors["kd"][self._others] = self._hold
        return command

    def _send(self) -> None:
        assert self._wire is not None
        assert self._command is not None
        self._command.sign()
        self._wire.send(self._command.body.tobytes())


class UnitreeRobotSide:
    """What a simulated robot uses to be driven like one of Unitree's.

    Its joints are the first motors. A command counts whose checksum and kind of robot are right.

    Args:
        n: Number of joints.
        interface: Network interface; None leaves it to the library.
        domain: Number of the DDS domain.
    """

    KIND = 5
    """What kind of robot it says to be."""

    def __init__(self, n: int, interface: str | None, domain: int) -> None:
        types = messages()
        self._wire = _Wire((interface, domain), (COMMAND, types.command), (STATE, types.state))
        self._n = n
        self._state = StateBytes()
        self._state.mode_machine = self.KIND
        self._fault = False
        self.braked = True

    def commands(self) -> np.ndarray | None:
        """Return the torque (n,) of the newest command that has come, None where none has."""
        body = self._wire.newest(0.0)
        command = None if body is None else CommandBytes(body)
        if command is None or not command.whole or command.mode_machine != self.KIND:
            return None
        motors, here = command.motors[: self._n], self._state.motors[: self._n]
        asked_to_brake = not np.any(motors["tau"]) and not np.any(motors["kp"])
        self._fault = self._fault and not asked_to_brake
        self.braked = asked_to_brake or self._fault or not np.all(command.enabled[: self._n])
        if self.braked:
            return None
        servo = motors["kp"] * (motors["q"] - here["q"]) + motors["kd"] * (
            motors["dq"] - here["dq"]
        )
        return motors["tau"].astype(float) + servo

    def tell(self, state: RobotState) -> None:
        """Send a state."""
        self._state.tick = round(state.t / MILLISECOND)
        motors = self._state.motors[: self._n]
        motors["q"], motors["dq"] = state.q, state.v
        self._wire.send(self._state.body.tobytes())

    def give_up(self) -> None:
        """Take no more commands until one has asked for brakes."""
        self.braked = self._fault = True

    def close(self) -> None:
        """Leave the network."""
        self._wire.close()


class _Wire:
    """One message that comes and one that goes.

    Args:
        where: Interface and domain.
        comes: Its name and type.
        goes: Its name and type.
    """

    def __init__(
        self, where: tuple[str | None, int], comes: tuple[str, Any], goes: tuple[str, Any]
    ) -> None:
        from cyclonedds.core import ReadCondition, SampleState, WaitSet  # noqa: PLC0415 - an extra
        from cyclonedds.domain import DomainParticipant  # noqa: PLC0415
        from cyclonedds.pub import DataWriter  # noqa: PLC0415
        from cyclonedds.sub import DataReader  # noqa: PLC0415
        from cyclonedds.topic import Topic  # noqa: PLC0415

        interface, number = where
        if interface is not None:
            _settle(number, interface)
        self._there: Any = DomainParticipant(number)
        self._reader: Any = DataReader(self._there, Topic(self._there, *comes))
        self._writer: Any = DataWriter(self._there, Topic(self._there, *goes))
        self._type = goes[1]
        self._waits = WaitSet(self._there)
        self._waits.attach(ReadCondition(self._reader, SampleState.NotRead))

    def newest(self, timeout: float) -> bytes | None:
        """Wait for a message, s; of several the newest is kept by the library."""
        if timeout > 0.0:
            self._waits.wait(round(timeout * 1e9))
        found = [one for one in self._reader.take(1) if hasattr(one, "body")]
        return found[-1].body if found else None

    def send(self, body: bytes) -> None:
        """Send a message."""
        self._writer.write(self._type(body))

    def alone(self, name: str) -> bool:
        """Tell whether nobody else sends this message, after a time in which others are found."""
        from cyclonedds.builtin import (  # noqa: PLC0415 - an extra
            BuiltinDataReader,
            BuiltinTopicDcpsPublication,
        )

        time.sleep(DISCOVERY)
        known = BuiltinDataReader(self._there, BuiltinTopicDcpsPublication).take(1000)
        topics = [getattr(one, "topic_name", "") for one in known]
        return topics.count(name) <= 1

    def close(self) -> None:
        """Leave."""
        del self._waits, self._reader, self._writer, self._there


_settled: dict[int, tuple[str, Any]] = {}
"""Interfaces of domains, and what keeps them so: a process settles each once."""


def _settle(number: int, interface: str) -> None:
    """Let a domain use an interface.

    Raises:
        InputError: In this process it uses another one.
    """
    from cyclonedds.domain import Domain  # noqa: PLC0415 - an extra

    if number not in _settled:
        _settled[number] = interface, Domain(number, _configuration(interface))
    if (used := _settled[number][0]) != interface:
        raise InputError(f"domain {number} uses interface {used!r} in this process already")


def _configuration(interface: str) -> str:
    """Tell the library to use one interface; a computer's own knows no multicast."""
    found = f'<General><Interfaces><NetworkInterface name="{interface}"/></Interfaces></General>'
    if interface == LOOPBACK:
        peers = '<Peers><Peer address="127.0.0.1"/></Peers>'
        found += f"<Discovery><ParticipantIndex>auto</ParticipantIndex>{peers}</Discovery>"
    return f"<CycloneDDS><Domain>{found}</Domain></CycloneDDS>"
