"""The observer that lets a run take its real time, and stops it to be looked at."""

from __future__ import annotations

import math
import time
from numbers import Real
from threading import Condition

import numpy as np

from opspace.command import Command
from opspace.errors import InputError

SLOWEST = 1e-3
"""Least seconds of the run per second of the clock."""

BEHIND = 0.1
"""Seconds that a run may be late before it gives up catching up."""


class Pacing:
    """Holds a run back to real time; it may be paused, stepped and slowed down from any thread.

    A run that cannot keep up is not hurried: after `BEHIND` seconds it goes on from where it is.

    Args:
        speed: Seconds of the run per second of the clock; inf is as fast as it goes.

    Raises:
        InputError: The speed is below `SLOWEST`.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._changed = Condition()
        self._speed = _speed(speed)
        self._paused = False
        self._steps = 0
        self._anchor: tuple[float, float] | None = None

    @property
    def paused(self) -> bool:
        """Whether the run waits."""
        return self._paused

    @property
    def speed(self) -> float:
        """Seconds of the run per second of the clock."""
        return self._speed

    @speed.setter
    def speed(self, value: float) -> None:
        with self._changed:
            self._speed = _speed(value)
            self._anchor = None
            self._changed.notify_all()

    def pause(self) -> None:
        """Let the run wait before its next tick."""
        with self._changed:
            self._paused, self._steps = True, 0

    def resume(self) -> None:
        """Let it go on."""
        with self._changed:
            self._paused, self._steps = False, 0
            self._anchor = None
            self._changed.notify_all()

    def step(self, ticks: int = 1) -> None:
        """Let a paused run do some ticks."""
        with self._changed:
            self._steps += ticks
            self._changed.notify_all()

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """Wait until this tick is due, and while the run is paused."""
        del q, v
        if self._paused:
            self._wait()
        if math.isinf(self._speed):
            return
        now = time.perf_counter()
        if self._anchor is None:
            self._anchor = (now, command.t)
        due = self._anchor[0] + (command.t - self._anchor[1]) / self._speed
        if due > now:
            with self._changed:
                self._changed.wait(due - now)
        elif now - due > BEHIND:
            self._anchor = (now, command.t)

    def _wait(self) -> None:
        with self._changed:
            while self._paused and self._steps == 0:
                self._changed.wait()
            if self._steps > 0:
                self._steps -= 1
                self._anchor = None


def _speed(value: float) -> float:
    if not isinstance(value, Real) or not float(value) >= SLOWEST:
        raise InputError(f"the speed must be a number of at least {SLOWEST:g}, got {value!r}")
    return float(value)
