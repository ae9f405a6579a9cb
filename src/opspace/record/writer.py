"""Writes a recording row by row, so that a killed process loses nothing that was recorded."""

from __future__ import annotations

import contextlib
import os
import platform
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError, RecordingError
from opspace.record import format as fmt


class Recorder:
    """Appends one row of numbers per tick to a recording directory.

    Used as a context manager it also records how the run ended: ``completed``, ``interrupted``
    on Ctrl-C, ``crashed`` on any other exception.

    Attributes:
        directory: Where the recording lies.
        columns: The columns in their order on disk.
    """

    def __init__(
        self,
        directory: Path | str,
        columns: Sequence[fmt.Column],
        header: Mapping[str, Any],
        *,
        overwrite: bool = False,
    ) -> None:
        """Create the recording.

        Args:
            directory: Directory to create or fill.
            columns: What each row holds.
            header: Anything else that describes the run, in JSON's types: ``scenario``, ``seed``,
                ``dt`` [s].
            overwrite: Replace a recording that is already there.

        Raises:
            InputError: The columns or the header cannot be used.
            RecordingError: A recording is already there, or the directory cannot be written.
        """
        self.directory = Path(directory)
        self.columns = tuple(columns)
        self._data = self.directory / fmt.DATA
        self._descriptor: int | None = None
        described = _describe(self.columns, header)
        self._descriptor = self._create(overwrite)
        try:
            created = datetime.now(timezone.utc).isoformat()
            fmt.write_json(
                self.directory / fmt.META, {"created": created, "platform": platform.platform()}
            )
            fmt.write_json(self.directory / fmt.HEADER, described)
        except BaseException:
            os.close(self._descriptor)
            self._descriptor = None
            self._data.unlink()
            raise

    def _create(self, overwrite: bool) -> int:
        # The data file is created exclusively and before the header: two runs can never share a
        # directory, and a header always has its data.
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
            if overwrite:
                for name in fmt.FILES:
                    (self.directory / name).unlink(missing_ok=True)
            elif (self.directory / fmt.HEADER).exists():
                raise FileExistsError
            return os.open(self._data, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except FileExistsError as error:
            if not self.directory.is_dir():
                raise RecordingError(f"{self.directory} is not a directory") from error
            raise RecordingError(
                f"{self.directory} already holds a recording; choose another directory (--out) or"
                " replace it (--overwrite, overwrite=True)"
            ) from error
        except OSError as error:
            raise RecordingError(f"{self.directory} cannot be written: {error.strerror}") from error

    def append(self, row: ArrayLike) -> None:
        """Write one row, at once and unbuffered.

        Args:
            row: (number of columns,) the values in the order of ``columns``.

        Raises:
            InputError: The row has another length, or holds something other than numbers.
            RecordingError: The recorder is closed, or the file cannot be written.
        """
        try:
            values = np.asarray(row, dtype=fmt.DTYPE)
        except (TypeError, ValueError) as error:
            raise InputError(
                f"a row of {self.directory} is not made of numbers: {error}"
            ) from error
        if values.shape != (len(self.columns),):
            raise InputError(
                f"a row of {self.directory} has shape ({len(self.columns)},), not {values.shape}"
            )
        self._write(values)

    def extend(self, rows: np.ndarray) -> None:
        """Write several rows at once.

        Args:
            rows: (rows, number of columns) as for `append`.

        Raises:
            InputError: The rows have another length.
            RecordingError: The recorder is closed, or the file cannot be written.
        """
        if rows.ndim != 2 or rows.shape[1] != len(self.columns):
            raise InputError(
                f"rows of {self.directory} have shape (rows, {len(self.columns)}), not {rows.shape}"
            )
        self._write(rows.astype(fmt.DTYPE))

    def _write(self, values: np.ndarray) -> None:
        if self._descriptor is None:
            raise RecordingError(f"{self.directory}: the recording is already closed")
        rest = memoryview(values.tobytes())
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError as error:
            # On a full disk the end cannot be written either; the rows so far are safe.
            with contextlib.suppress(RecordingError):
                self.close("crashed", f"{self._data.name} cannot be written: {error.strerror}")
            raise RecordingError(f"{self._data} cannot be written: {error.strerror}") from error

    def close(self, how: fmt.Ended = "completed", reason: str = "") -> None:
        """Finish the recording and say how it ended; a second call does nothing.

        Args:
            how: ``completed``, ``stopped``, ``interrupted`` or ``crashed``.
            reason: Why, in words.

        Raises:
            InputError: ``how`` is none of these.
            RecordingError: The files cannot be written.
        """
        if self._descriptor is None:
            return
        if how == "unfinished":
            raise InputError("a recording is unfinished by not being closed")
        row = len(self.columns) * np.dtype(fmt.DTYPE).itemsize
        # The file, not a counter, knows the rows: an interrupt can fall between the two.
        rows = os.fstat(self._descriptor).st_size // row
        end = fmt.End(how, reason, rows)
        descriptor, self._descriptor = self._descriptor, None
        try:
            os.ftruncate(descriptor, rows * row)
            os.fsync(descriptor)
        except OSError as error:
            raise RecordingError(f"{self._data} cannot be written: {error.strerror}") from error
        finally:
            os.close(descriptor)
        fmt.write_json(
            self.directory / fmt.END, {"ended": end.how, "reason": end.reason, "rows": end.rows}
        )

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is None:
            self.close()
        elif isinstance(error, KeyboardInterrupt):
            self.close("interrupted")
        else:
            self.close("crashed", f"{type(error).__name__}: {error}")


def _describe(columns: tuple[fmt.Column, ...], header: Mapping[str, Any]) -> dict[str, Any]:
    fmt.check_columns(columns)
    own = {
        "format": fmt.FORMAT,
        "format_version": fmt.FORMAT_VERSION,
        "versions": fmt.package_versions(),
        "columns": [
            {"name": c.name, "unit": c.unit, "description": c.description} for c in columns
        ],
    }
    for key in header:
        if key in own:
            raise InputError(f"header key {key!r} is written by the recorder itself")
    return {**own, **header}
