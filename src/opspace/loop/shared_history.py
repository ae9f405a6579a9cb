"""The last cycles of a loop in memory that other programs see, and that outlives the loop."""

from __future__ import annotations

import mmap
import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from opspace.errors import InputError
from opspace.kernels.cycle_columns import RING, WHOLES
from opspace.loop.history import History, width_of
from opspace.robots.protocol import Robot

MAGIC = int.from_bytes(b"OSC_HIST", "little")
NUMBERS = 5
"""Words before those of the loop: `MAGIC`, nq, n, rows, and how it has ended."""
WORDS = 64
"""Words before the rows; the last of them are the reason of the end, in UTF-8."""
REASON = 24
"""The first of these."""
ENDS = ("", "completed", "stopped", "crashed")
"""How a loop has ended, by the number in the file; the first is not yet."""
GONE = "the process of the loop is gone"
"""Why, where the loop could not say it any more."""


class SharedHistory(History):
    """A ring of cycles in a file, best one of ``/dev/shm``, that another process can follow.

    What a cycle leaves there is there when the process of the loop is killed in the next moment, also
    where cycles are compiled. `opspace.LoopRecorder` writes it down.

    Words of 8 bytes: `MAGIC`, nq, n, rows, the end (0 not yet, 1 completed, 2 stopped, 3 crashed), ten
    whole numbers of the loop, the fourth of which counts the cycles; from the 25th the reason of the
    end in UTF-8; from the 65th the rows, t, q, v, tau, status and the time to the answer of each as
    doubles. Cycle k is in row k modulo their number. While the loop's process lives, it holds a lock
    (``flock``) on the file.

    Args:
        path: The file; one that another loop has left is replaced.
        robot: The robot of the loop.
        rows: How many cycles are remembered.

    Raises:
        InputError: The file is something else or a loop's that goes on, or there is no cycle to
            remember.
        OSError: It cannot be written.
    """

    def __init__(self, path: Path | str, robot: Robot, rows: int = 10_000) -> None:
        super().__init__(rows, robot.nq, robot.nv)
        self.path = Path(path)
        _check_free(self.path)
        size = 8 * (WORDS + self.rows.size)
        unfinished = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        head = np.zeros(WORDS, np.int64)
        head[: NUMBERS - 1] = MAGIC, robot.nq, robot.nv, rows
        self._file: int | None = None
        try:
            unfinished.write_bytes(head.tobytes() + self.rows.tobytes())
            file = self._file = os.open(unfinished, os.O_RDWR)
            _take(file)
            unfinished.replace(self.path)
        except OSError:
            unfinished.unlink(missing_ok=True)
            raise
        words = np.frombuffer(mmap.mmap(file, size), np.int64)
        self._end, self._reason = words[NUMBERS - 1 : NUMBERS], words[REASON:WORDS]
        self.whole = words[NUMBERS : NUMBERS + WHOLES]
        self.rows = words[WORDS:].view(np.float64).reshape(self.rows.shape)

    def end(self, how: str, reason: str) -> None:
        """See `History.end`."""
        text = np.zeros(8 * self._reason.size, np.uint8)
        said = np.frombuffer(reason.encode()[: text.size], np.uint8)
        text[: said.size] = said
        self._reason[:] = text.view(np.int64)
        self._end[0] = ENDS.index(how)

    def close(self) -> None:
        """Remove the file; who has it open keeps it."""
        if self._file is not None:
            self.path.unlink(missing_ok=True)
            os.close(self._file)
            self._file = None


class AddedCycles(NamedTuple):
    """What has been added to a history since the last look.

    Attributes:
        rows: (k, 3 + nq + 2n,) the cycles, the oldest first.
        lost: How many were overwritten before they were read.
    """

    rows: np.ndarray
    lost: int


class HistoryFollower:
    """Reads a `SharedHistory` of another process while it is being written.

    Attributes:
        seen: How many cycles have been read or were lost.

    Args:
        path: The file.

    Raises:
        InputError: It is something else.
        OSError: There is none.
    """

    def __init__(self, path: Path | str) -> None:
        self._file = os.open(path, os.O_RDWR)
        whole = Path(path).stat().st_size // 8
        words = np.frombuffer(mmap.mmap(self._file, 8 * whole), np.int64) if whole else np.zeros(1)
        head = words[: NUMBERS - 1].tolist() if words.size >= WORDS else [0] * (NUMBERS - 1)
        magic, nq, n, rows = head
        if magic != MAGIC or words.size != WORDS + rows * width_of(nq, n):
            os.close(self._file)
            raise InputError(f"{path} is not the history of a loop")
        self._words = words
        self._rows = words[WORDS:].view(np.float64).reshape(rows, width_of(nq, n))
        self.seen = 0

    @property
    def end(self) -> tuple[str, str] | None:
        """How the loop has ended and why, None while it goes on; ``crashed`` where it was killed."""
        code = int(self._words[NUMBERS - 1])
        if code != 0:
            reason = self._words[REASON:WORDS].tobytes().rstrip(b"\0")
            return ENDS[code], reason.decode(errors="ignore")
        return ("crashed", GONE) if _free(self._file) else None

    def more(self, *, ended: bool) -> AddedCycles:
        """Copy what has been added.

        Args:
            ended: Whether the loop has ended, and nobody writes any more.
        """
        size = len(self._rows)
        # The last one may not be whole yet, and the next one be on its way to where the oldest is.
        unfinished = 0 if ended else 1
        last = int(self._words[NUMBERS + RING]) - unfinished
        first = max(self.seen, last - size + 2 * unfinished)
        rows = self._rows[np.arange(first, last) % size]
        # Those that were overwritten while they were read are lost, too.
        now = int(self._words[NUMBERS + RING])
        torn = min(max(0, now - size + 1 - first), len(rows)) if not ended else 0
        lost = max(0, first - self.seen) + torn
        self.seen = max(self.seen, last)
        return AddedCycles(rows[torn:], lost)

    def close(self) -> None:
        """Look at it no more."""
        os.close(self._file)


def _check_free(path: Path) -> None:
    """Refuse a file that is no history, or that of a loop which goes on."""
    if not path.exists():
        return
    with path.open("r+b") as file:
        if file.read(8) != MAGIC.to_bytes(8, "little"):
            raise InputError(f"{path} is there already, and is not the history of a loop")
        if not _free(file.fileno()):
            raise InputError(f"{path} is the history of a loop that goes on")


def _take(descriptor: int) -> None:
    """Lock a file; the system takes the lock back when the process that opened it is gone."""
    import fcntl  # noqa: PLC0415 - not everywhere

    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _free(descriptor: int) -> bool:
    """Tell whether nobody else has locked a file."""
    import fcntl  # noqa: PLC0415 - not everywhere

    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    fcntl.flock(descriptor, fcntl.LOCK_UN)
    return True
