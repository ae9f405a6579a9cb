"""A robot behind UDP: what goes over the wire, the driver, and the robot's side of it."""

from __future__ import annotations

import contextlib
import socket
import struct
import time

import numpy as np

from opspace.errors import InputError, RobotStoppedError
from opspace.loop.driver import DriverFacts, RobotState

HELLO, STATE, COMMAND, BRAKE, FAULT = b"OSCH", b"OSCS", b"OSCC", b"OSCB", b"OSCF"
"""First four bytes of a packet."""
HEAD = struct.Struct("<4sI")
"""Kind and number; everything else is doubles, all of it little-endian."""
DOUBLE = np.dtype("<f8")
LARGEST = 65536
BRAKES = 3
"""A request to brake is sent so often: any one may be lost."""


class UdpDriver:
    """A robot of one's own that sends its state over UDP and takes torques.

    ===========  ============================================  ===========================
    packet       after four letters and a uint32               sent by
    ===========  ============================================  ===========================
    ``OSCH``     nothing: send your state to where this is     the driver, until one comes
                 from
    ``OSCS``     number of the state; t, q (nq), v (n), τ (n)  the robot, every period
    ``OSCC``     number of the state it answers; τ (n)         the driver
    ``OSCB``     nothing: brake                                the driver, at the end
    ``OSCF``     number of the next state; nothing: the robot  the robot, in the place of
                 has braked and waits for ``OSCH``             states
    ===========  ============================================  ===========================

    Numbers are little-endian doubles, SI and radians. The τ of a state is the last command that was
    accepted, NaN before the first. Numbers begin anew at 0 after 2³² − 1. The robot must brake by
    itself when commands stay away.

    Args:
        host: Name or address of the robot.
        port: Its port.
        nq: Coordinates of a configuration.
        n: Number of joints.
        facts: What the robot does by itself.
    """

    def __init__(self, host: str, port: int, *, nq: int, n: int, facts: DriverFacts) -> None:
        self.facts = facts
        self._address = (host, port)
        self._nq, self._n = nq, n
        self._size = HEAD.size + DOUBLE.itemsize * (1 + nq + 2 * n)
        self._socket: socket.socket | None = None
        self._number = 0
        self._heard = False

    def start(self) -> None:
        """Ask the robot for its states.

        Raises:
            OSError: There is no way to it.
        """
        self._socket = socket.socket(*_family(self._address))
        self._socket.connect(self._address)
        self._heard = False
        self._socket.send(HEAD.pack(HELLO, 0))

    def read(self, timeout: float) -> RobotState | None:
        """Wait for a state; of several that wait the newest is taken.

        Raises:
            InputError: Packets are those of a robot of another size.
            RobotStoppedError: The robot has braked by itself.
        """
        assert self._socket is not None
        packet = self._newest(timeout)
        if packet is None:
            if not self._heard:
                with contextlib.suppress(OSError):
                    self._socket.send(HEAD.pack(HELLO, 0))
            return None
        kind, number = HEAD.unpack_from(packet)
        if kind == FAULT:
            raise RobotStoppedError("the robot has braked by itself and takes no commands")
        if kind != STATE or len(packet) != self._size:
            raise InputError(
                f"the robot sent {kind!r} of {len(packet)} bytes; a state of {self._nq} coordinates "
                f"and {self._n} joints is {STATE!r} of {self._size}"
            )
        self._heard, self._number = True, number
        numbers = np.frombuffer(packet, DOUBLE, offset=HEAD.size)
        q, v, tau = np.split(numbers[1:], [self._nq, self._nq + self._n])
        return RobotState(float(numbers[0]), q, v, None if np.isnan(tau[0]) else tau)

    def write(self, tau: np.ndarray) -> None:
        """Answer the last state."""
        assert self._socket is not None
        packet = HEAD.pack(COMMAND, self._number) + tau.astype(DOUBLE).tobytes()
        # A robot that has just gone is seen by its silence.
        with contextlib.suppress(ConnectionError):
            self._socket.send(packet)

    def stop(self) -> None:
        """Ask the robot to brake."""
        if self._socket is None:
            return
        for _ in range(BRAKES):
            with contextlib.suppress(OSError):
                self._socket.send(HEAD.pack(BRAKE, 0))
        self._socket.close()
        self._socket = None

    def _newest(self, timeout: float) -> bytes | None:
        """Take what has come, and wait for the first of it."""
        assert self._socket is not None
        found: bytes | None = None
        newest = 0
        end = time.perf_counter() + timeout
        while True:
            left = end - time.perf_counter() if found is None else 0.0
            self._socket.settimeout(max(left, 0.0))
            try:
                packet = self._socket.recv(LARGEST)
            except (TimeoutError, BlockingIOError):
                return found
            except ConnectionError:
                # Nobody listens there yet, or any more; the system says so once for each packet.
                time.sleep(max(min(left, 1e-3), 0.0))
                continue
            if len(packet) < HEAD.size:
                continue
            number = HEAD.unpack_from(packet)[1]
            if found is None or newer(number, newest):
                found, newest = packet, number


class UdpRobotSide:
    """The robot's side of `UdpDriver`.

    Args:
        port: Port to listen at; 0 for any that is free.
        n: Number of joints.
        host: Address to listen at.
    """

    def __init__(self, port: int, n: int, host: str = "127.0.0.1") -> None:
        self._socket = socket.socket(*_family((host, port)))
        self._socket.bind((host, port))
        self._socket.setblocking(False)
        self._size = HEAD.size + DOUBLE.itemsize * n
        self._peer: object = None
        self._last = -1
        self._number = 0
        self._fault = False
        self.braked = True

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._socket.getsockname()[1])

    def commands(self) -> np.ndarray | None:
        """Return the newest command (n,) that has come, None where none has."""
        found: np.ndarray | None = None
        while True:
            try:
                packet, peer = self._socket.recvfrom(LARGEST)
            except (BlockingIOError, ConnectionError):
                return found
            if len(packet) < HEAD.size:
                continue
            kind, number = HEAD.unpack_from(packet)
            if kind == HELLO and (self.braked or self._peer is None):
                self._peer, self.braked, self._fault, self._last = peer, False, False, -1
            elif peer != self._peer:
                continue
            elif kind == BRAKE:
                self.braked = True
            elif kind == COMMAND and len(packet) == self._size and self._is_new(number):
                self._last = number
                found = np.frombuffer(packet, DOUBLE, offset=HEAD.size)

    def _is_new(self, number: int) -> bool:
        return self._last < 0 or newer(number, self._last)

    def tell(self, state: RobotState) -> None:
        """Send a state to the driver, or that the robot has braked."""
        self._number = (self._number + 1) % 2**32
        if self._peer is None:
            return
        packet = HEAD.pack(FAULT, self._number)
        if not self._fault:
            assert state.tau is not None
            content = np.concatenate([[state.t], state.q, state.v, state.tau])
            packet = HEAD.pack(STATE, self._number) + content.astype(DOUBLE).tobytes()
        with contextlib.suppress(OSError):
            self._socket.sendto(packet, self._peer)  # pyright: ignore[reportArgumentType]

    def give_up(self) -> None:
        """Say that the robot has braked by itself, until the next driver comes."""
        self.braked = self._fault = True

    def close(self) -> None:
        """Listen no more."""
        self._socket.close()


def newer(number: int, than: int) -> bool:
    """Whether a number was given out after another one, beginning anew included."""
    return 0 < (number - than) % 2**32 < 2**31


def _family(address: tuple[str, int]) -> tuple[int, int]:
    family = socket.getaddrinfo(*address, type=socket.SOCK_DGRAM)[0][0]
    return family, socket.SOCK_DGRAM
