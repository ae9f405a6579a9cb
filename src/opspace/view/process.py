"""Starts the process of a page, and talks with it."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import Any

from opspace.errors import OpspaceError, missing_extra

STARTING = 60.0
"""Seconds that a page may take to start."""

LEAVING = 5.0
"""Seconds that it may take to go."""

WAITING = 1000
"""Messages that may wait for a page that does not listen; later ones are lost."""


def check_installed() -> None:
    """Refuse to begin what would need the viewer.

    Raises:
        MissingExtraError: The viewer is not installed.
    """
    if find_spec("viser") is None:
        raise missing_extra("viser", "view")


class PageProcess:
    """A page in a process of its own: nothing it does, and nothing done to it, delays a run.

    Args:
        directory: Recording that it shows.
        host: Address to listen at.
        port: Port to listen at.
        heard: Told about every message from the page, in a thread of its own.
        gone: Called when the page is gone, in the same thread.
    """

    def __init__(
        self,
        directory: Path,
        host: str,
        port: int,
        heard: Callable[[Mapping[str, Any]], None],
        gone: Callable[[], None],
    ) -> None:
        command = [sys.executable, "-m", "opspace.view", str(directory)]
        self._process = subprocess.Popen(
            [*command, "--host", host, "--port", str(port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            # Ctrl-C is for the run; the page goes when the run lets it go.
            start_new_session=True,
        )
        self._heard, self._gone = heard, gone
        self._ready, self._visited = Event(), Event()
        self._failure = ""
        self.address = ""
        self._messages: Queue[str | None] = Queue(WAITING)
        self._threads = [Thread(target=t, daemon=True) for t in (self._listen, self._speak)]
        for thread in self._threads:
            thread.start()

    def wait(self) -> None:
        """Wait until the page can be opened.

        Raises:
            OpspaceError: It cannot be opened.
        """
        if not self._ready.wait(STARTING):
            self._failure = f"it did not start within {STARTING:g} s"
        if self._failure or not self.address:
            self.close()
            code = self._process.returncode
            reason = self._failure or f"its process ended with exit status {code}"
            raise OpspaceError(f"the page cannot be shown: {reason}")

    def wait_for_visitor(self) -> None:
        """Wait until a browser has opened the page, or the page is gone."""
        # In short waits, or Ctrl-C would not be heard.
        while not self._visited.wait(0.2):
            pass

    def say(self, message: Mapping[str, Any]) -> None:
        """Send a message, without waiting for the page to read it."""
        with contextlib.suppress(Full):
            self._messages.put_nowait(json.dumps(message))

    def close(self) -> None:
        """Let the page go."""
        try:
            self._messages.put_nowait(None)
            self._process.wait(LEAVING)
        except (Full, subprocess.TimeoutExpired):
            self._process.kill()
            self._process.wait()
        # Whoever still writes finds nobody; whoever waits for something to write finds the end.
        with contextlib.suppress(Empty, Full):
            while self._messages.full():
                self._messages.get_nowait()
            self._messages.put_nowait(None)
        for thread in self._threads:
            thread.join(LEAVING)

    def _speak(self) -> None:
        """Pass messages on; what was not said when the page is gone is of no interest."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError, ValueError), self._process.stdin as stream:
            while (message := self._messages.get()) is not None:
                stream.write(message + "\n")
                stream.flush()

    def _listen(self) -> None:
        assert self._process.stdout is not None
        try:
            with self._process.stdout as messages:
                for line in messages:
                    self._take(line)
        finally:
            self._ready.set()
            self._visited.set()
            self._gone()

    def _take(self, line: str) -> None:
        # A page that is killed leaves half a line.
        try:
            message = json.loads(line)
        except ValueError:
            return
        if "address" in message:
            self.address = message["address"]
            self._ready.set()
        elif "failed" in message:
            self._failure = message["failed"]
            self._ready.set()
        elif "visited" in message:
            self._visited.set()
        else:
            self._heard(message)
