"""A robot behind shared memory: its layout, the driver, and the robot's side of it."""

from __future__ import annotations

import contextlib
import mmap
import os
import time
from pathlib import Path

import numpy as np

from opspace.errors import InputError, RobotStoppedError
from opspace.loop.driver import DriverFacts, RobotState
from opspace.loop.free_cycles import SharedWords

MAGIC = int.from_bytes(b"OSC_SHM1", "little")
HEAD = 4
"""Words before the state: `MAGIC`, nq, n, and what the driver wants."""
REST, DRIVE, BRAKE, FAULT = range(4)
"""What a driver wants; the last is written by a robot that has braked by itself."""
NAP = 2e-5
"""For how long a wait sleeps between two looks, s."""
TRIES = 100


class SharedBlock:
    """A state and a command in memory that two programs see.

    A file, best one of ``/dev/shm``, of words of 8 bytes: `MAGIC`, nq, n, what the driver wants, then
    the state and the command. Each of these is a uint64 that is odd while it is being written, its
    numbers as doubles, and the sum of these words as uint64 modulo 2⁶⁴; a reader takes it when the
    first word was even and the same before and after, and the sum is right.

    ==========  =============================================
    part        numbers
    ==========  =============================================
    state       t, q (nq), v (n), τ (n) of the last command that was accepted, NaN before
                the first
    command     τ (n)
    ==========  =============================================

    Args:
        path: The file.
        nq: Coordinates of a configuration.
        n: Number of joints.
        create: Make the file; the robot does.

    Raises:
        InputError: The file is another one's.
        OSError: There is no such file, or it cannot be made.
    """

    def __init__(self, path: Path | str, nq: int, n: int, *, create: bool = False) -> None:
        state, command = 3 + nq + 2 * n, 2 + n
        size = 8 * (HEAD + state + command)
        if create:
            _create(Path(path), nq, n, size)
        with open(path, "r+b") as file:
            found = Path(path).stat().st_size
            if found != size:
                raise InputError(
                    f"{path} has {found} bytes; a robot of {nq} coordinates and {n} joints has {size}"
                )
            self._map = mmap.mmap(file.fileno(), size)
        self.words = np.frombuffer(self._map, np.uint64)
        if tuple(self.words[:3].tolist()) != (MAGIC, nq, n):
            raise InputError(
                f"{path} is not the memory of a robot of {nq} coordinates and {n} joints"
            )
        self._state = self.words[HEAD : HEAD + state]
        self._command = self.words[HEAD + state :]

    @property
    def wanted(self) -> int:
        """What the driver wants."""
        return int(self.words[3])

    @wanted.setter
    def wanted(self, value: int) -> None:
        self.words[3] = value

    @property
    def told(self) -> int:
        """Changes with every state."""
        return int(self._state[0])

    @property
    def commanded(self) -> int:
        """Changes with every command."""
        return int(self._command[0])

    def put_state(self, numbers: np.ndarray) -> None:
        """Write t, q, v and tau."""
        _put(self._state, numbers)

    def put_command(self, tau: np.ndarray) -> None:
        """Write a torque."""
        _put(self._command, tau)

    def state(self) -> np.ndarray | None:
        """Read t, q, v and tau; None where somebody writes all the time."""
        return _get(self._state)

    def command(self) -> np.ndarray | None:
        """Read the torque; None where somebody writes all the time."""
        return _get(self._command)

    def close(self) -> None:
        """Look at it no more."""
        del self.words, self._state, self._command
        # Cycles without Python may hold parts of it, and it goes with them.
        with contextlib.suppress(BufferError):
            self._map.close()


class SharedMemoryDriver:
    """A robot whose own program shares memory with this one, see `SharedBlock`.

    The robot makes the file, and must brake by itself when commands stay away.

    Attributes:
        seen: First word of the last state that was read.

    Args:
        path: The file.
        nq: Coordinates of a configuration.
        n: Number of joints.
        facts: What the robot does by itself.
        spin: Look without a pause; takes a core, and wakes up some 50 µs earlier.
    """

    def __init__(
        self, path: Path | str, *, nq: int, n: int, facts: DriverFacts, spin: bool = False
    ) -> None:
        self.facts = facts
        self._path, self._nq, self._n = Path(path), nq, n
        self._spin = spin
        self._block: SharedBlock | None = None
        self.seen = 0

    def shared(self) -> SharedWords:
        """Return the memory for cycles without Python, after `start`."""
        assert self._block is not None
        words = self._block.words.view(np.int64)
        state = HEAD + 3 + self._nq + 2 * self._n
        nap = 0 if self._spin else round(1e9 * NAP)
        return SharedWords(words[3:4], words[HEAD:state], words[state:], FAULT, nap)

    def start(self) -> None:
        """Open the memory, and let the robot take commands.

        Raises:
            InputError: It is that of another robot, or somebody else drives it.
            OSError: There is none.
        """
        block = SharedBlock(self._path, self._nq, self._n)
        if block.wanted == DRIVE:
            block.close()
            raise InputError(
                f"{self._path}: somebody drives this robot, or did and the robot has not noticed his end"
            )
        self._block, self.seen = block, block.told
        block.wanted = DRIVE

    def read(self, timeout: float) -> RobotState | None:
        """Wait for a state that is another one than the last.

        Raises:
            RobotStoppedError: The robot has braked by itself.
        """
        block = self._block
        assert block is not None
        end = time.perf_counter() + timeout
        while (told := block.told) == self.seen or told % 2:
            if time.perf_counter() > end:
                return None
            if not self._spin:
                time.sleep(NAP)
        if block.wanted == FAULT:
            raise RobotStoppedError("the robot has braked by itself and takes no commands")
        found = block.state()
        if found is None:
            return None
        self.seen = told
        q, v, tau = np.split(found[1:], [self._nq, self._nq + self._n])
        return RobotState(float(found[0]), q, v, None if np.isnan(tau[0]) else tau)

    def write(self, tau: np.ndarray) -> None:
        """Leave a torque for the robot."""
        assert self._block is not None
        self._block.put_command(tau)

    def stop(self) -> None:
        """Let the robot brake."""
        if self._block is not None:
            self._block.wanted = BRAKE
            self._block.close()
            self._block = None


class SharedRobotSide:
    """The robot's side of `SharedMemoryDriver`; it makes the file, and removes it.

    Args:
        path: The file.
        nq: Coordinates of a configuration.
        n: Number of joints.
    """

    def __init__(self, path: Path | str, nq: int, n: int) -> None:
        self._path = Path(path)
        self._block = SharedBlock(path, nq, n, create=True)
        self._seen = 0

    @property
    def braked(self) -> bool:
        """Whether nobody drives."""
        return self._block.wanted != DRIVE

    def commands(self) -> np.ndarray | None:
        """Return a command (n,) that has not been seen, None where there is none."""
        made = self._block.commanded
        if made == self._seen or made % 2:
            return None
        found = self._block.command()
        if found is not None:
            self._seen = made
        return found

    def tell(self, state: RobotState) -> None:
        """Show a state."""
        assert state.tau is not None
        self._block.put_state(np.concatenate([[state.t], state.q, state.v, state.tau]))

    def give_up(self) -> None:
        """Say that the robot has braked by itself, until the next driver comes."""
        self._block.wanted = FAULT

    def close(self) -> None:
        """Remove the file."""
        self._block.close()
        self._path.unlink(missing_ok=True)


def _create(path: Path, nq: int, n: int, size: int) -> None:
    """Put a new file in the place of one that a robot has left; who has that open keeps it."""
    if path.exists() and path.read_bytes()[:8] != MAGIC.to_bytes(8, "little"):
        raise InputError(f"{path} is there already, and is not the memory of a robot")
    head = np.array([MAGIC, nq, n], np.uint64).tobytes()
    unfinished = path.with_name(f"{path.name}.{os.getpid()}")
    unfinished.write_bytes(head + bytes(size - len(head)))
    unfinished.replace(path)


def _put(part: np.ndarray, numbers: np.ndarray) -> None:
    words = np.ascontiguousarray(numbers, np.float64).view(np.uint64)
    begun = int(part[0])
    begun += begun % 2  # somebody was killed while he wrote
    part[0] = begun + 1
    part[1:-1] = words
    part[-1] = np.add.reduce(words)
    part[0] = begun + 2


def _get(part: np.ndarray) -> np.ndarray | None:
    for _ in range(TRIES):
        before = int(part[0])
        words = part[1:-1].copy()
        total = part[-1]
        if before % 2 == 0 and int(part[0]) == before and np.add.reduce(words) == total:
            return words.view(np.float64)
    return None
