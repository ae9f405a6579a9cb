"""A loop is written down by another process, which neither delays it nor dies with it."""

from __future__ import annotations

import contextlib
import json
import logging
import select
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import astuple
from pathlib import Path
from threading import Event, Thread
from types import TracebackType
from typing import TYPE_CHECKING, Any, cast

from opspace.controller import ReferenceController
from opspace.errors import InputError, OpspaceError, RecordingError
from opspace.loop.shared_history import GONE, HistoryFollower, SharedHistory
from opspace.record.format import Column, Ended
from opspace.record.observer import STATUS, state_columns
from opspace.record.subject import subject_of
from opspace.record.writer import Recorder

if TYPE_CHECKING:
    from typing_extensions import Self

log = logging.getLogger("opspace")

LOOK = 2e-3
"""How often it is looked for new cycles, s."""
STARTING = 60.0
"""How long the process may take to begin, s."""
ENDING = 10.0
"""How long it may take to write down the rest, s."""
READY = "ready"
ENOUGH = b"enough"


class LoopRecorder:
    """Has a process of its own write the cycles of a loop into a recording.

    The process looks into the loop's `SharedHistory` every 2 ms, so the loop waits for nothing, also
    where its cycles are compiled. Whoever is killed, what was looked at is on the disk: the process of
    the loop, and the recording ends with its last cycle but one and says ``crashed``; this one, and the
    loop goes on without it. Use it around the loop::

        history = osc.SharedHistory("/dev/shm/arm-cycles", robot)
        loop = osc.Loop(controller, driver, history=history)
        with osc.LoopRecorder(history, controller, "results/arm"), loop:
            ...

    Columns are t, q, v, tau, status, and ``answered``, the time from a state to its command.

    Args:
        history: That of the loop.
        controller: The controller of the loop, for what the recording says about itself.
        directory: Where the recording is written.
        header: What it says besides, in JSON's own types.
        overwrite: Replace a recording that is already there.

    Raises:
        RecordingError: There is a recording already, the directory cannot be written, or the process
            does not begin.
        InputError: The header is not of JSON's types.
    """

    def __init__(
        self,
        history: SharedHistory,
        controller: ReferenceController,
        directory: Path | str,
        header: Mapping[str, Any] | None = None,
        *,
        overwrite: bool = False,
    ) -> None:
        self.directory = Path(directory)
        columns = [*state_columns(controller.robot), STATUS]
        columns.append(Column("answered", "s", "time from the state to its command"))
        told = {
            "path": str(history.path.absolute()),
            "directory": str(self.directory.absolute()),
            "columns": [astuple(column) for column in columns],
            "header": {**subject_of(controller), **(header or {})},
            "overwrite": overwrite,
        }
        try:
            line = json.dumps(told).encode() + b"\n"
        except (TypeError, ValueError) as error:
            raise InputError(f"the header cannot be written down: {error}") from None
        self._process = subprocess.Popen(
            [sys.executable, "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,  # what it says at its end is not read with what it says at its beginning
            start_new_session=True,  # Ctrl-C is for the loop; this one ends behind it
        )
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it may be gone
            self._process.stdin.write(line)
        said = self._first_line()
        if said != READY:
            self._process.kill()
            self._process.communicate()
            raise RecordingError(said or "the process that records has ended before it began")

    def _first_line(self) -> str:
        stdout = self._process.stdout
        assert stdout is not None
        if not select.select([stdout], [], [], STARTING)[0]:
            return f"the process that records did not begin within {STARTING:g} s"
        return stdout.readline().decode().strip()

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def close(self) -> None:
        """Wait until the rest is written; a loop that goes on is recorded no further.

        Cycles that were overwritten before they were read are warned of.

        Raises:
            RecordingError: It was killed, could not write, or still writes after `ENDING`.
        """
        process = self._process
        assert process.stdin is not None
        try:
            said, _ = process.communicate(None if process.stdin.closed else ENOUGH, ENDING)
        except subprocess.TimeoutExpired:
            raise RecordingError(
                f"{self.directory}: the process that records still writes after {ENDING:g} s"
            ) from None
        if process.returncode != 0:
            raise RecordingError(
                f"{self.directory}: the process that records has ended with {process.returncode}"
            )
        if said:
            log.warning("%s: %s", self.directory, said.decode().strip())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class _Owner:
    """Whoever began this process, in the other of its pipes."""

    def __init__(self) -> None:
        self._silent, self._word = Event(), ""
        Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        self._word = sys.stdin.read()
        self._silent.set()

    def end(self, seconds: float) -> tuple[str, str] | None:
        """Wait so long; tell how it ends if he has let this go, or is gone without a word."""
        if not self._silent.wait(seconds):
            return None
        return ("stopped", "nobody wanted more of it") if self._word else ("crashed", GONE)


def follow(history: HistoryFollower, recorder: Recorder, owner: _Owner) -> None:
    """Write cycles down until the loop has ended, or nobody wants more of them."""
    lost = 0
    while True:
        let_go = owner.end(LOOK)
        end = history.end or let_go
        killed = end == ("crashed", GONE)
        found = history.more(ended=end is not None and not killed and end is not let_go)
        lost += found.lost
        if len(found.rows):
            recorder.extend(found.rows)
        if end is not None:
            break
    how, reason = end
    if lost:
        told = f"{lost} cycles were overwritten before they were read"
        reason = f"{reason}; {told}".lstrip("; ")
        with contextlib.suppress(BrokenPipeError):  # whoever began this may be gone
            print(told, flush=True)
    recorder.close(cast("Ended", how), reason)


def main() -> None:
    """Be that process: what to do comes from the standard input."""
    told = json.loads(sys.stdin.readline())
    try:
        history = HistoryFollower(told["path"])
        columns = [Column(*column) for column in told["columns"]]
        recorder = Recorder(
            Path(told["directory"]), columns, told["header"], overwrite=told["overwrite"]
        )
    except (OpspaceError, OSError) as error:
        print(error, flush=True)
        sys.exit(2)
    print(READY, flush=True)
    with recorder:
        follow(history, recorder, _Owner())


if __name__ == "__main__":
    main()
