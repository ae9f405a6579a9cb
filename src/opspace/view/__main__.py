"""The process of a page: it reads the recording from the disk, so that a run never waits for it.

Messages go line by line as JSON: to the run on the standard output, from it on the standard input.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
from pathlib import Path
from threading import Lock, Thread
from typing import Any

from opspace.view.controls import Ask
from opspace.view.page import Page


def main() -> None:
    """Serve a page until the run that started it says goodbye."""
    parser = argparse.ArgumentParser(prog="python -m opspace.view")
    parser.add_argument("directory", type=Path)
    parser.add_argument("--host", required=True)
    parser.add_argument("--port", type=int, required=True)
    given = parser.parse_args()
    say = _speaker()
    pages: list[Page] = []
    # From the first moment on: a page whose run is gone must not stay.
    Thread(target=_listen, args=(pages,), daemon=True).start()
    try:
        page = Page(given.directory, given.host, given.port, say)
    # Whatever it is, the run tells it to whoever wanted to see the page.
    except Exception as error:
        say({"failed": f"{type(error).__name__}: {error}"})
        sys.exit(2)
    pages.append(page)
    page.on_visit(lambda: say({"visited": True}))
    say({"address": page.address})
    page.serve()


def _speaker() -> Ask:
    """Take the standard output for messages; whoever else prints does so on the error stream."""
    stream = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    lock = Lock()

    def say(message: dict[str, Any]) -> None:
        # Without a reader the run is gone; the page notices it at its standard input.
        with lock, contextlib.suppress(BrokenPipeError):
            stream.write(json.dumps(message) + "\n")
            stream.flush()

    return say


def _listen(pages: list[Page]) -> None:
    """Pass on what the run says, and leave with it."""
    try:
        for line in sys.stdin:
            message = json.loads(line)
            for page in pages:
                if message.get("ended"):
                    page.end()
                else:
                    page.answer(message["answer"], message["reason"])
    finally:
        # The web server has threads that would wait for browsers.
        os._exit(0)


if __name__ == "__main__":
    main()
