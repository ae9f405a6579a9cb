"""What Unitree's humanoids send and take through DDS, as the bytes that go over the wire.

The messages ``LowState_`` and ``LowCmd_`` of ``unitree_hg`` (G1, H1-2): https://github.com/unitreerobotics
"""

from __future__ import annotations

import functools
import zlib
from typing import Any, NamedTuple

import numpy as np

from opspace.errors import InputError, missing_extra

MOTORS = 35
"""Places for motors in every message, whatever robot it is."""
PLAIN_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
"""Head of what is sent: no version, no key, little-endian."""
HEAD = len(PLAIN_LITTLE_ENDIAN)

# Plain CDR fills up to the size of the next number only, so that the mode of the first motor moves
# into what is filled up before it; those of the others lie as in an array of structures of C.
_COMMAND_MOTOR, _COMMAND_MODE = 28, 2
COMMAND_SIZE = 1000
_MOTOR_COMMAND = np.dtype(
    {
        "names": ["mode", "q", "dq", "tau", "kp", "kd"],
        "formats": ["u1", "<f4", "<f4", "<f4", "<f4", "<f4"],
        "offsets": [0, 4, 8, 12, 16, 20],
        "itemsize": _COMMAND_MOTOR,
    }
)
_STATE_START, _STATE_MOTOR = 68, 56
STATE_SIZE = 2088
_MOTOR_STATE = np.dtype(
    {
        "names": ["q", "dq", "tau_est"],
        "formats": ["<f4", "<f4", "<f4"],
        "offsets": [4, 8, 16],
        "itemsize": _STATE_MOTOR,
    }
)
_MODE_MACHINE, _TICK = 9, 12

_BITS_TURNED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


class StateBytes:
    """The bytes of a state, with names for what is read of them.

    Attributes:
        motors: (35,) records of ``q`` rad, ``dq`` rad/s, ``tau_est`` N·m, which may be written.
    """

    def __init__(self, body: bytes | None = None) -> None:
        self.body = np.zeros(STATE_SIZE, np.uint8)
        if body is not None:
            self.body[:] = np.frombuffer(body, np.uint8, STATE_SIZE)
        end = _STATE_START + MOTORS * _STATE_MOTOR
        self.motors = self.body[_STATE_START:end].view(_MOTOR_STATE)
        self._tick = self.body[_TICK : _TICK + 4].view("<u4")

    @property
    def tick(self) -> int:
        """Time of the robot, ms, modulo 2³²."""
        return int(self._tick[0])

    @tick.setter
    def tick(self, milliseconds: int) -> None:
        self._tick[0] = milliseconds % 2**32

    @property
    def mode_machine(self) -> int:
        """What kind of robot it is; commands are taken that say the same."""
        return int(self.body[_MODE_MACHINE])

    @mode_machine.setter
    def mode_machine(self, kind: int) -> None:
        self.body[_MODE_MACHINE] = kind


class CommandBytes:
    """The bytes of a command.

    Attributes:
        motors: (35,) records of ``q``, ``dq``, ``tau``, ``kp``, ``kd`` and ``mode``: the motor gives
            τ + kp (q − its position) + kd (dq − its speed).
    """

    def __init__(self, body: bytes | None = None) -> None:
        self.body = np.zeros(COMMAND_SIZE, np.uint8)
        if body is not None:
            self.body[:] = np.frombuffer(body, np.uint8, COMMAND_SIZE)
        self.motors = self.body[: MOTORS * _COMMAND_MOTOR].view(_MOTOR_COMMAND)
        self._sum = self.body[-4:].view("<u4")

    def enable(self, motors: np.ndarray, mode_machine: int) -> None:
        """Say which motors are commanded, and of what kind of robot."""
        modes = np.zeros(MOTORS, np.uint8)
        modes[motors] = 1
        self.motors["mode"][1:] = modes[1:]
        self.body[:2] = 0, mode_machine
        self.body[_COMMAND_MODE] = modes[0]

    @property
    def enabled(self) -> np.ndarray:
        """(35,) whether motors are commanded."""
        modes = self.motors["mode"].copy()
        modes[0] = self.body[_COMMAND_MODE]
        return modes == 1

    @property
    def mode_machine(self) -> int:
        """Of what kind of robot it says to be."""
        return int(self.body[1])

    @property
    def whole(self) -> bool:
        """Whether its checksum is right."""
        return int(self._sum[0]) == self.checksum()

    def sign(self) -> None:
        """Write the checksum of the rest."""
        self._sum[0] = self.checksum()

    def checksum(self) -> int:
        """Return the checksum that the robot expects: CRC-32/MPEG-2 of the words of its structure."""
        body = self.body
        start = bytes((*body[:2], 0, 0, *body[_COMMAND_MODE : _COMMAND_MODE + 2], 0, 0))
        words = np.frombuffer(start + body[4:-4].tobytes(), "<u4").astype(">u4").tobytes()
        # The library's sum takes the bits of a byte from the other end and gives them back so.
        turned = zlib.crc32(words.translate(_BITS_TURNED)) ^ 0xFFFFFFFF
        return int(f"{turned:032b}"[::-1], 2)


def _as_a_whole(message: Any) -> Any:
    """Let objects of a type hold bytes, and be written and read as such."""

    def begin(self: Any, body: bytes) -> None:
        self.body = body

    def serialize(self: Any, **options: object) -> bytes:
        del options  # there is one way to write it, whatever is asked
        return PLAIN_LITTLE_ENDIAN + self.body

    def deserialize(data: bytes, **options: object) -> Any:
        del options
        if data[1] % 2 == 0:
            raise InputError(f"a {message.__name__} came with its numbers the other way round")
        return message(data[HEAD:])

    message.__init__, message.serialize = begin, serialize
    message.deserialize = staticmethod(deserialize)
    return message


class Messages(NamedTuple):
    """The types of the two messages, whose objects hold bytes: ``body``."""

    state: Any
    command: Any


@functools.cache
def messages() -> Messages:
    """Declare the messages to `cyclonedds`.

    They are written and read as a whole: to go through them field by field, as the library does,
    takes it 0.4 ms each.

    Raises:
        MissingExtraError: `cyclonedds` is not installed.
    """
    try:
        from cyclonedds import idl  # noqa: PLC0415 - an extra
        from cyclonedds.idl import annotations  # noqa: PLC0415
        from cyclonedds.idl import types as t  # noqa: PLC0415
    except ImportError:
        raise missing_extra("cyclonedds", "unitree") from None

    def struct(name: str, fields: dict[str, Any]) -> Any:
        found = idl.make_idl_struct(name, f"unitree_hg.msg.dds_.{name}", fields, dataclassify=False)
        return annotations.autoid("sequential")(annotations.final(found))

    imu = struct(
        "IMUState_",
        {
            "quaternion": t.array[t.float32, 4],
            "gyroscope": t.array[t.float32, 3],
            "accelerometer": t.array[t.float32, 3],
            "rpy": t.array[t.float32, 3],
            "temperature": t.int16,
        },
    )
    motor_state = struct(
        "MotorState_",
        {
            "mode": t.uint8,
            **dict.fromkeys(("q", "dq", "ddq", "tau_est"), t.float32),
            "temperature": t.array[t.int16, 2],
            "vol": t.float32,
            "sensor": t.array[t.uint32, 2],
            "motorstate": t.uint32,
            "reserve": t.array[t.uint32, 4],
        },
    )
    motor_command = struct(
        "MotorCmd_",
        {
            "mode": t.uint8,
            **dict.fromkeys(("q", "dq", "tau", "kp", "kd"), t.float32),
            "reserve": t.uint32,
        },
    )
    state = struct(
        "LowState_",
        {
            "version": t.array[t.uint32, 2],
            "mode_pr": t.uint8,
            "mode_machine": t.uint8,
            "tick": t.uint32,
            "imu_state": imu,
            "motor_state": t.array[motor_state, MOTORS],
            "wireless_remote": t.array[t.uint8, 40],
            "reserve": t.array[t.uint32, 4],
            "crc": t.uint32,
        },
    )
    command = struct(
        "LowCmd_",
        {
            "mode_pr": t.uint8,
            "mode_machine": t.uint8,
            "motor_cmd": t.array[motor_command, MOTORS],
            "reserve": t.array[t.uint32, 4],
            "crc": t.uint32,
        },
    )
    return Messages(_as_a_whole(state), _as_a_whole(command))
