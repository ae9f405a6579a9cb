"""The last seconds before a failure, written by a loop that records nothing else."""

from __future__ import annotations

import time
import warnings
from collections import deque
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Command, Status
from opspace.controller import ReferenceController
from opspace.controller.wrenches import Wrenches
from opspace.errors import InputError, OpspaceError, RecordingError
from opspace.record.format import Ended
from opspace.record.observer import STATUS, state_columns
from opspace.record.obstacle_columns import (
    HEADER_KEY,
    about_collisions,
    columns_of_obstacles,
    row_of_placings,
)
from opspace.record.wrench_columns import Given, columns_of_wrenches, row_of_wrenches
from opspace.record.writer import Recorder
from opspace.robots import Robot
from opspace.tasks.obstacles import Placing

FAILURES = Status.FAULT | Status.LIMIT_LOST | Status.COLLISION_LOST
"""What is written down by itself; a tick that raises always is."""

MOST = 20
"""A box writes no more recordings than this: a loop that goes on failing must not fill the disk."""

PAUSE = 0.05
"""The thread that writes lets the loop go on for so long before it begins, s."""

RAISED = "raised"
FIRST = "first"
FAILURE = "failure"

_both = int.__and__  # that of flags is Python's and slow
_Tick = tuple[float, bytes, bytes, bytes, int, Given, Mapping[str, Placing]]
"""t, q, v, τ, status, wrenches and obstacles of a tick."""


class BlackBox:
    """Steps a controller, remembers its last ticks, and writes them down when one of them fails.

    Use it in the controller's place: ``box.step(t, q, v)`` answers and raises what
    ``controller.step`` does. A tick whose status has one of ``on``, or that raises, becomes the last
    row of a recording (`opspace.load`), together with the ticks before it. The rows are copied in
    that tick; the files are written by a thread that also ends in peace when the program ends. A
    kind of failure that lasts is written again only when every remembered tick is a new one.

    The header holds the first tick ever (targets may be what was found there), the failure, what the
    tasks did last, and ``header``. ``opspace replay`` runs it again if that names the scenario, as
    `opspace.scenario.Built.header` does; `opspace.replay` does so with any controller.

    Args:
        controller: The controller; requests go to it and its stack as before.
        directory: Where recordings are written, a directory for each.
        ticks: How many ticks are remembered.
        on: Statuses that are failures.
        header: What recordings say besides, in JSON's own types.

    Raises:
        InputError: There is no tick to remember.
        RecordingError: The directory cannot be written.
    """

    def __init__(
        self,
        controller: ReferenceController,
        directory: Path | str,
        *,
        ticks: int = 5000,
        on: Status = FAILURES,
        header: Mapping[str, Any] | None = None,
    ) -> None:
        if ticks < 1:
            raise InputError(f"a black box remembers at least one tick, not {ticks}")
        self.directory = Path(directory)
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingError(f"{directory}: cannot be written: {error.strerror}") from error
        self._robot, self._tick = controller.robot, controller.step
        self._controller = controller
        self._gravity = controller.gravity
        self._header = dict(header or {})
        self._on = int(on)
        self._ticks = ticks
        self._kept: deque[_Tick] = deque(maxlen=ticks)
        self._seen = 0
        self._first: dict[str, Any] | None = None
        self._last: Command | None = None
        self._quiet_until: dict[str, int] = {}
        # Started here: to wait for a new thread in the tick that fails would cost the most of it.
        self._writer = ThreadPoolExecutor(1, thread_name_prefix="black box")
        self._writing: list[Future[None]] = [self._writer.submit(time.sleep, 0.0)]
        self.written: list[Path] = []

    @property
    def robot(self) -> Robot:
        """The controller's robot."""
        return self._robot

    @property
    def gravity(self) -> str:
        """Who adds the torque that holds the weight, see `opspace.Controller`."""
        return self._gravity

    @property
    def wrenches(self) -> Given:
        """Wrenches that the last tick was given, see `opspace.Controller.wrenches`."""
        return self._controller.wrenches

    def step(
        self, t: float, q: ArrayLike, v: ArrayLike, *, wrenches: Wrenches | None = None
    ) -> Command:
        """Compute the torque for one state; see `opspace.Controller.step`."""
        try:
            command = self._tick(t, q, v, wrenches=wrenches)
        except Exception as error:
            self._keep_refused(t, q, v, wrenches)
            self._failed(RAISED, f"{type(error).__name__}: {error}", None)
            raise
        # Bytes are copied quicker than rows of an array are written; the robot holds the state as
        # the controller took it.
        robot, status = self._robot, command.status
        given, placings = self._controller.wrenches, self._controller.placings
        state = robot.q.tobytes(), robot.v.tobytes()
        self._kept.append((t, *state, command.tau.tobytes(), status, given, placings))
        self._seen += 1
        if self._first is None:
            self._first = {"t": float(t), "q": robot.q.tolist(), "v": robot.v.tolist()}
            if given:
                self._first["wrenches"] = {
                    name: None if wrench is None else wrench.tolist()
                    for name, wrench in given.items()
                }
        if _both(status, self._on):
            kind = "|".join(s.name or "" for s in Status if s & status & self._on)
            self._failed(kind, kind, command)
        self._last = command
        return command

    def wait(self) -> None:
        """Wait until what has failed so far is on the disk."""
        for writing in self._writing:
            writing.result()

    def _keep_refused(
        self, t: float, q: ArrayLike, v: ArrayLike, wrenches: Wrenches | None
    ) -> None:
        """Remember a tick that has no torque, as far as it is made of numbers."""
        n = self._robot.nv
        when = _numbers(t, 1)[0]
        torque = np.full(n, np.nan).tobytes()
        state = _numbers(q, self._robot.nq).tobytes(), _numbers(v, n).tobytes()
        given = {
            str(name): None if wrench is None else _numbers(wrench, 6)
            for name, wrench in (wrenches or {}).items()
        }
        self._kept.append((when, *state, torque, 0, given, self._controller.placings))
        self._seen += 1

    def _failed(self, kind: str, reason: str, command: Command | None) -> None:
        """Hand what is remembered to a thread that writes it."""
        if self._seen < self._quiet_until.get(kind, 0) or len(self.written) >= MOST:
            return
        self._quiet_until[kind] = self._seen + self._ticks
        name = f"{datetime.now():%Y%m%d-%H%M%S}-{len(self.written)}-{kind.lower()}"
        path = self.directory / name.replace("|", "-")
        self.written.append(path)
        work = self._write, path, tuple(self._kept), kind, reason, self._last, command
        self._writing.append(self._writer.submit(*work))

    def _write(
        self,
        path: Path,
        kept: Sequence[_Tick],
        kind: str,
        reason: str,
        before: Command | None,
        command: Command | None,
    ) -> None:
        time.sleep(PAUSE)
        ended: Ended = "crashed" if kind == RAISED else "stopped"
        header = {
            **self._header,
            FIRST: self._first,
            FAILURE: {"kind": kind, "row": len(kept) - 1},
            "tasks": _tasks(command if command is not None and command.tasks else before),
        }
        if self._controller.collisions is not None:
            header[HEADER_KEY] = about_collisions(self._controller.collisions)
        sensors = tuple(sorted({name for tick in kept for name in tick[-2]}))
        obstacles = tuple(dict.fromkeys(name for tick in kept for name in tick[-1]))
        columns = [
            *state_columns(self.robot),
            STATUS,
            *columns_of_wrenches(sensors),
            *columns_of_obstacles(obstacles),
        ]
        try:
            with Recorder(path, columns, header) as recorder:
                recorder.extend(_rows(kept, sensors, obstacles))
                recorder.close(ended, reason)
        except OpspaceError as error:
            warnings.warn(f"the black box could not be written: {error}", stacklevel=1)


def _numbers(values: ArrayLike | float, size: int) -> np.ndarray:
    """Read as many numbers; all of them are NaN where the values are something else."""
    try:
        return np.array(values, dtype=float).reshape(size)
    except (TypeError, ValueError, OverflowError):
        return np.full(size, np.nan)


def _rows(kept: Sequence[_Tick], sensors: Sequence[str], obstacles: Sequence[str]) -> np.ndarray:
    """Write ticks as rows of a recording."""
    t, q, v, tau, status, given, placings = zip(*kept, strict=True)
    groups = [np.frombuffer(b"".join(group)).reshape(len(kept), -1) for group in (q, v, tau)]
    more: list[list[np.ndarray]] = []
    if sensors:
        more.append([np.concatenate(row_of_wrenches(tick, sensors)) for tick in given])
    if obstacles:
        more.append([np.concatenate(row_of_placings(tick, obstacles)) for tick in placings])
    return np.column_stack([t, *groups, status, *more])


def _tasks(command: Command | None) -> dict[str, Any]:
    """What the tasks did in a tick, in JSON's own types."""
    if command is None:
        return {}
    return {
        name: {
            "activation": float(task.activation),
            "levels": [[float(number), float(weight)] for number, weight in task.levels],
            "error": task.error.tolist(),
        }
        for name, task in command.tasks.items()
    }
