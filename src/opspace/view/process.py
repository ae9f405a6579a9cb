"""Starts the process of a page, and talks with it."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from threading import Event, Thread
from typing import Any

from opspace.errors import OpspaceError, missing_extra

STARTING = 60.0
"""Seconds that a page may take to start."""


class PageProcess:
    """A page in a process of its own: nothing it does, and nothing done to it, delays a run.

    Args:
        directory: Recording that it shows, with a row at least when it is waited for.
        host: Address to listen at.
        port: Port to listen at.
        heard: Told about every message from the page, in a thread of its own.

    Raises:
        MissingExtraError: The viewer is not installed.
    """

    def __init__(
        self, directory: Path, host: str, port: int, heard: Callable[[Mapping[str, Any]], None]
    ) -> None:
        if find_spec("viser") is None:
            raise missing_extra("viser", "view")
        command = [sys.executable, "-m", "opspace.view", str(directory)]
        self._process = subprocess.Popen(
            [*command, "--host", host, "--port", str(port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            # Ctrl-C is for the run; the page goes when the run lets it go.
            start_new_session=True,
        )
        self._heard = heard
        self._ready, self._visited = Event(), Event()
        self._failure = ""
        self.address = ""
        self._listening = Thread(target=self._listen, daemon=True)
        self._listening.start()

    def wait(self) -> None:
        """Wait until the page can be opened.

        Raises:
            OpspaceError: It cannot be opened.
        """
        if not self._ready.wait(STARTING) or not self.address:
            self.close()
            reason = self._failure or f"it did not start within {STARTING:g} s"
            raise OpspaceError(f"the page cannot be shown: {reason}")

    def wait_for_visitor(self) -> None:
        """Wait until a browser has opened the page, or the page is gone."""
        # In short waits, or Ctrl-C would not be heard.
        while not self._visited.wait(0.2):
            pass

    def say(self, message: Mapping[str, Any]) -> None:
        """Send a message; a page that is gone does not mind."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError, ValueError):
            self._process.stdin.write(json.dumps(message) + "\n")
            self._process.stdin.flush()

    def close(self) -> None:
        """Let the page go."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._listening.join(5.0)

    def _listen(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as messages:
            for line in messages:
                self._take(json.loads(line))
        self._ready.set()
        self._visited.set()

    def _take(self, message: Mapping[str, Any]) -> None:
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
