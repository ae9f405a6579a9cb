"""The last seconds before a failure, written by a loop that records nothing else."""

from __future__ import annotations

import threading
import warnings
from array import array
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.controller import Command, ReferenceController, Status
from opspace.errors import InputError, OpspaceError, RecordingError
from opspace.record.format import Ended
from opspace.record.observer import STATUS, state_columns
from opspace.record.writer import Recorder
from opspace.robots import Robot

FAILURES = Status.FAULT | Status.LIMIT_LOST
"""What is written down by itself; a tick that raises always is."""

MOST = 20
"""A box writes no more recordings than this: a loop that goes on failing must not fill the disk."""

RAISED = "raised"
FIRST = "first"
FAILURE = "failure"
_ALL = ...  # as an index it is quicker than a slice


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
        self._controller = controller
        self._header = dict(header or {})
        self._on = int(on)
        self._ticks = ticks
        self._make_rows(controller.robot)
        self._next = 0
        self._seen = 0
        self._first: dict[str, Any] | None = None
        self._last: Command | None = None
        self._quiet_until: dict[str, int] = {}
        self._threads: list[threading.Thread] = []
        self.written: list[Path] = []

    @property
    def robot(self) -> Robot:
        """The controller's robot."""
        return self._controller.robot

    def step(self, t: float, q: ArrayLike, v: ArrayLike) -> Command:
        """Compute the torque for one state; see `opspace.Controller.step`."""
        try:
            command = self._controller.step(t, q, v)
        except Exception as error:
            self._keep_refused(t, q, v)
            self._failed(RAISED, f"{type(error).__name__}: {error}", None)
            raise
        i = self._next
        self._t[i] = t
        self._q[i][_ALL] = q
        self._v[i][_ALL] = v
        self._tau[i][_ALL] = command.tau
        self._status[i] = command.status
        self._advance()
        if self._status[i] & self._on:
            kind = "|".join(s.name or "" for s in Status if s & command.status & self._on)
            self._failed(kind, kind, command)
        self._last = command
        return command

    def wait(self) -> None:
        """Wait until what has failed so far is on the disk."""
        for thread in self._threads:
            thread.join()

    def _make_rows(self, robot: Robot) -> None:
        sizes = np.cumsum([robot.nq, robot.nv, robot.nv])
        self._numbers = np.zeros((self._ticks, sizes[-1]))
        # A view for each row: finding it by its number would cost more than the copy.
        q, v, tau, _ = np.split(self._numbers, sizes, axis=1)
        self._q, self._v, self._tau = list(q), list(v), list(tau)
        self._t = array("d", bytes(8 * self._ticks))
        self._status = array("q", bytes(8 * self._ticks))

    def _advance(self) -> None:
        if self._first is None:
            i = self._next
            self._first = {"t": self._t[i], "q": self._q[i].tolist(), "v": self._v[i].tolist()}
        self._seen += 1
        self._next = self._seen % self._ticks

    def _keep_refused(self, t: float, q: ArrayLike, v: ArrayLike) -> None:
        """Remember a tick that has no torque, as far as it is made of numbers."""
        i = self._next
        self._numbers[i] = self._t[i] = np.nan
        self._status[i] = 0
        for rows, value in ((self._q, q), (self._v, v)):
            try:
                rows[i][:] = np.asarray(value, dtype=float).reshape(rows[i].shape)
            except (TypeError, ValueError):
                continue
        try:
            self._t[i] = float(t)
        except (TypeError, ValueError):
            pass
        self._seen += 1
        self._next = self._seen % self._ticks

    def _failed(self, kind: str, reason: str, command: Command | None) -> None:
        """Hand what is remembered to a thread that writes it."""
        if self._seen < self._quiet_until.get(kind, 0) or len(self.written) >= MOST:
            return
        self._quiet_until[kind] = self._seen + self._ticks
        name = f"{datetime.now():%Y%m%d-%H%M%S}-{len(self.written)}-{kind.lower()}"
        path = self.directory / name.replace("|", "-")
        self.written.append(path)
        thread = threading.Thread(
            target=self._write, args=(path, self._rows(), kind, reason, self._last, command)
        )
        self._threads = [t for t in self._threads if t.is_alive()] + [thread]
        thread.start()

    def _rows(self) -> np.ndarray:
        """Copy what is remembered, the oldest tick first."""
        count = min(self._seen, self._ticks)
        order = np.arange(self._seen - count, self._seen) % self._ticks
        t, status = np.frombuffer(self._t), np.frombuffer(self._status, dtype=np.int64)
        return np.column_stack([t[order], self._numbers[order], status[order]])

    def _write(
        self,
        path: Path,
        rows: np.ndarray,
        kind: str,
        reason: str,
        before: Command | None,
        command: Command | None,
    ) -> None:
        ended: Ended = "crashed" if kind == RAISED else "stopped"
        header = {
            **self._header,
            FIRST: self._first,
            FAILURE: {"kind": kind, "row": len(rows) - 1},
            "tasks": _tasks(command if command is not None and command.tasks else before),
        }
        columns = [*state_columns(self.robot), STATUS]
        try:
            with Recorder(path, columns, header) as recorder:
                recorder.append(rows)
                recorder.close(ended, reason)
        except OpspaceError as error:
            warnings.warn(f"the black box could not be written: {error}", stacklevel=1)


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
