"""The observer that shows a run in a browser while it goes on, and lets it be changed from there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from opspace.command import Command
from opspace.contacts import GroundContact
from opspace.controller import ReferenceController
from opspace.errors import InputError, OpspaceError
from opspace.loop.pacing import Pacing
from opspace.loop.requests import FILE, Changes, RequestDesk, RunRequest
from opspace.record.contact_columns import Felt
from opspace.record.format import Ended
from opspace.record.observer import State, TickRecorder
from opspace.tasks import Task
from opspace.view.process import PageProcess, check_installed

if TYPE_CHECKING:
    from typing_extensions import Self

HOST = "127.0.0.1"
PORT = 8080


class Viewer:
    """Record a run and show it on a web page while it goes on.

    The page lives in a process of its own and reads the recording from the disk, so a run that is
    watched does what it does without: the same ticks, the same numbers. It is up when the viewer is
    built, which takes a few seconds; no tick waits for it. What is asked for on the page
    is applied between two ticks and written to ``requests.jsonl`` beside the recording.

    Used as a context manager around `opspace.simulate`, or with `observe` after every tick of a loop
    of one's own.

    Args:
        controller: The controller of the run.
        directory: Where the recording is written.
        header: What the recording says about itself.
        tasks: Tasks that are not in the stack yet, for the page to insert.
        levels: Tasks that may be at each level, see `opspace.TickRecorder`.
        truth: See `opspace.TickRecorder`.
        contacts: Contacts that are not in the stack yet, for the page to insert.
        felt: See `opspace.TickRecorder`.
        overwrite: Replace a recording that is already there.
        speed: Seconds of the run per second of the clock; None holds nothing back, for a loop that
            has a clock of its own. Then the page cannot pause either.
        host: Address to listen at; the default lets nobody in from other machines.
        port: Port to listen at; the next free one is taken where it is in use.
        opened: Told about the page's address once it can be opened.
        wait: Wait for a browser to open the page before the run begins.

    Raises:
        MissingExtraError: The viewer is not installed.
        InputError: A task that does not fit the robot, or a speed not above 0.
        RecordingError: There is a recording already, or the directory cannot be written.
        OpspaceError: The page cannot be shown.
    """

    def __init__(
        self,
        controller: ReferenceController,
        directory: Path | str,
        header: Mapping[str, object] | None = None,
        *,
        tasks: Sequence[Task] = (),
        levels: Mapping[float, Sequence[Task]] | None = None,
        truth: State | None = None,
        contacts: Sequence[GroundContact] = (),
        felt: Felt | None = None,
        overwrite: bool = False,
        speed: float | None = 1.0,
        host: str = HOST,
        port: int = PORT,
        opened: Callable[[str], None] = lambda address: print(f"open {address}"),
        wait: bool = False,
    ) -> None:
        check_installed()
        directory = Path(directory)
        self._pacing = None if speed is None else Pacing(speed)
        self._recorder = TickRecorder(
            directory,
            controller,
            header or {},
            tasks=tasks,
            levels=levels,
            truth=truth,
            contacts=contacts,
            felt=felt,
            overwrite=overwrite,
        )
        self._desk = RequestDesk(
            Changes(controller, tasks, contacts), directory / FILE, self._answer
        )
        self._page = PageProcess(directory, host, port, self._hear, self._go_on)
        try:
            self._page.wait()
            opened(self._page.address)
            if wait:
                self._page.wait_for_visitor()
        except BaseException as error:
            self._leave(error)
            raise

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """Record a tick, do what was asked for, and wait until the next one is due."""
        self._recorder.observe(q, v, command)
        self._desk.observe(q, v, command)
        if self._pacing is not None:
            self._pacing.observe(q, v, command)

    def ask(self, request: RunRequest) -> None:
        """Ask for something as the page does, from any thread."""
        self._desk.ask(request)

    def end(self, how: Ended = "completed", reason: str = "") -> None:
        """Finish the recording; the page still shows it until `close`.

        Args:
            how: How the run ended, see `opspace.Recorder.close`.
            reason: Why, in words.
        """
        self._recorder.close(how, reason)
        self._desk.close()
        self._page.say({"ended": True})

    def close(self) -> None:
        """Finish the recording and let the page go."""
        self.end()
        self._page.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._leave(error)

    def _leave(self, error: BaseException | None) -> None:
        if isinstance(error, KeyboardInterrupt):
            self.end("interrupted")
        elif error is not None:
            self.end("crashed", f"{type(error).__name__}: {error}")
        self.close()

    def _go_on(self) -> None:
        """Let a run that was paused from a page go on when the page is gone."""
        if self._pacing is not None:
            self._pacing.resume()

    def _answer(self, request: RunRequest, reason: str) -> None:
        what = f"{request.kind} {request.about}"
        self._page.say({"answer": what, "reason": reason})

    def _hear(self, message: Mapping[str, Any]) -> None:
        """Do what the page says; in a thread of the page's."""
        try:
            if "request" in message:
                self._desk.ask(RunRequest.read(message["request"]))
            elif self._pacing is not None:
                self._control(self._pacing, message)
        except OpspaceError as error:
            self._page.say({"answer": "request", "reason": str(error)})

    @staticmethod
    def _control(pacing: Pacing, message: Mapping[str, Any]) -> None:
        match message.get("control"):
            case "pause":
                pacing.pause()
            case "resume":
                pacing.resume()
            case "step":
                pacing.pause()
                pacing.step()
            case "speed":
                pacing.speed = message.get("value", 1.0)
            case other:
                raise InputError(f"a page cannot ask for {other!r}")
