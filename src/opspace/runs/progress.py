"""A progress bar for long runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import TaskID

    from opspace.command import Command

EVERY = 20
"""Ticks between two updates; more often would cost more than a tick."""


class ProgressBar:
    """Shows one line per run on the terminal's error stream; nothing where there is no terminal.

    Used as a context manager around one or several runs.
    """

    def __init__(self) -> None:
        from rich.progress import (  # noqa: PLC0415 - slow to import
            BarColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        console = _error_stream()
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.completed:.1f} of {task.total:.1f} s", markup=False),
            TimeElapsedColumn(),
            TextColumn("left", markup=False),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
        )

    def run(self, title: str, duration: float) -> ProgressLine:
        """Add a line for a run.

        Args:
            title: What runs.
            duration: Simulated time, s.

        Returns:
            The observer that moves it.
        """
        line = self._progress.add_task(title, total=duration)
        return ProgressLine(self, line)

    def __enter__(self) -> ProgressBar:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._progress.stop()

    def move(self, line: TaskID, t: float) -> None:
        """Move a line to a simulated time."""
        self._progress.update(line, completed=t)


class ProgressLine:
    """The observer of one run.

    Args:
        bar: The bar that shows it.
        line: Its line there.
    """

    def __init__(self, bar: ProgressBar, line: TaskID) -> None:
        self._bar = bar
        self._line = line
        self._ticks = 0

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """See one tick."""
        del q, v
        self._ticks += 1
        if self._ticks % EVERY == 1:
            self._bar.move(self._line, command.t)

    def finish(self, t: float) -> None:
        """Show where the run ended."""
        self._bar.move(self._line, t)


@contextmanager
def counter(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show how many of something are done, on the terminal's error stream where there is one.

    Args:
        what: What is counted.

    Yields:
        A function that takes how many are done, and of how many.
    """
    from rich.progress import (  # noqa: PLC0415 - slow to import
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = _error_stream()
    columns = (TextColumn(what, markup=False), BarColumn(), MofNCompleteColumn())
    times = (TimeElapsedColumn(), TextColumn("left", markup=False), TimeRemainingColumn())
    with Progress(*columns, *times, console=console, disable=not console.is_terminal) as progress:
        line = progress.add_task(what, total=None)

        def show(done: int, total: int) -> None:
            progress.update(line, completed=done, total=total)

        yield show


def _error_stream() -> Console:
    """Return the error stream, which says nothing where it is no terminal."""
    from rich.console import Console  # noqa: PLC0415 - slow to import

    console = Console(stderr=True)
    # A bar that is disabled ends with an empty line all the same in some versions of rich.
    console.quiet = not console.is_terminal
    return console
