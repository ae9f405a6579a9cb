"""What the operating system does for a loop, as far as it is permitted."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass

from opspace.errors import InputError

MCL_CURRENT, MCL_FUTURE = 1, 2
HIGHEST = 99


@dataclass(frozen=True)
class RealTime:
    """Asks for priority, memory and a core; what is refused is said, and the loop goes without.

    Attributes:
        priority: Priority of the loop's thread among those of real time (SCHED_FIFO), 1 to 99; None
            leaves it an ordinary one.
        core: Number of the core that the thread stays on; None for any.
        lock_memory: Whether the memory of the process is kept from being swapped out.
        quiet_collector: Whether the collector of garbage leaves alone what is there at the start.
        switch_interval: After how long another Python thread that computes gives way, s; None leaves
            the 5 ms of Python.

    Raises:
        InputError: A priority, a core or an interval that cannot be.
    """

    priority: int | None = 80
    core: int | None = None
    lock_memory: bool = True
    quiet_collector: bool = True
    switch_interval: float | None = 1e-4

    def __post_init__(self) -> None:
        if self.priority is not None and not 1 <= self.priority <= HIGHEST:
            raise InputError(f"a priority is from 1 to {HIGHEST}, not {self.priority}")
        if self.core is not None and not 0 <= self.core < (os.cpu_count() or 1):
            raise InputError(f"there is no core {self.core}: {os.cpu_count()} are there, from 0")
        if self.switch_interval is not None and not self.switch_interval > 0.0:
            raise InputError(f"switch_interval must be above 0 s, got {self.switch_interval}")

    def take(self) -> tuple[list[str], Callable[[], None]]:
        """Ask for everything, for the thread that calls.

        Returns:
            What was refused, a sentence each, and what gives back what others would notice.
        """
        refused: list[str] = []
        if self.priority is not None:
            refused += _asked("real-time priority", "run as root or set rtprio", self._schedule)
        if self.core is not None:
            refused += _asked(f"core {self.core}", "see taskset", self._pin)
        if self.lock_memory:
            refused += _asked("locked memory", "raise memlock", _lock_memory)
        interval = sys.getswitchinterval()
        if self.switch_interval is not None:
            sys.setswitchinterval(self.switch_interval)
        if self.quiet_collector:
            gc.collect()
            gc.freeze()

        def give_back() -> None:
            sys.setswitchinterval(interval)
            if self.lock_memory:
                ctypes.CDLL(None).munlockall()
            if self.quiet_collector:
                gc.unfreeze()

        return refused, give_back

    def _schedule(self) -> None:
        assert self.priority is not None
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(self.priority))

    def _pin(self) -> None:
        assert self.core is not None
        os.sched_setaffinity(0, {self.core})


def _asked(what: str, remedy: str, ask: Callable[[], None]) -> list[str]:
    try:
        ask()
    except (OSError, AttributeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "not on this system"
        return [f"{what} was refused ({reason}); {remedy}"]
    return []


def _lock_memory() -> None:
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(MCL_CURRENT | MCL_FUTURE) != 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code))
