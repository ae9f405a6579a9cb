"""Reads a recording while it is being written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from opspace.errors import InputError, RecordingError
from opspace.record import format as fmt


class GrowingRecording:
    """The rows of a recording that are there so far.

    Args:
        directory: The recording's directory.

    Attributes:
        header: Everything in ``header.json``.
        index: Place of each column by name.

    Raises:
        RecordingError: A file is missing, or it is no recording.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.header: dict[str, Any] = fmt.read_json(directory / fmt.HEADER)
        if self.header.get("format") != fmt.FORMAT:
            raise RecordingError(f"{directory / fmt.HEADER} is not the header of a recording")
        try:
            names = [column["name"] for column in self.header["columns"]]
        except (KeyError, TypeError) as error:
            raise RecordingError(f"{directory / fmt.HEADER} lists no columns: {error}") from None
        self.index = {name: place for place, name in enumerate(names)}
        self._width = len(names)
        self._data = np.empty((0, self._width))
        self.refresh()

    @property
    def data(self) -> np.ndarray:
        """(rows, columns) what was there at the last `refresh`, read-only."""
        return self._data

    @property
    def ended(self) -> bool:
        """Whether whoever writes has said that it is finished."""
        return (self.directory / fmt.END).exists()

    def refresh(self) -> int:
        """See what has been added; return the number of complete rows.

        Raises:
            RecordingError: The rows cannot be read.
        """
        path = self.directory / fmt.DATA
        try:
            rows = path.stat().st_size // (8 * self._width)
            if rows != len(self._data):
                shape = (rows, self._width)
                self._data = (
                    np.memmap(path, fmt.DTYPE, "r", shape=shape) if rows else np.empty(shape)
                )
        except (OSError, ValueError) as error:
            raise RecordingError(f"{path} cannot be read: {error}") from error
        return len(self._data)

    def columns(self, names: list[str]) -> list[int]:
        """Return the places of columns.

        Raises:
            InputError: There is no such column.
        """
        missing = [name for name in names if name not in self.index]
        if missing:
            raise InputError(f"{self.directory} has no column {missing[0]!r}")
        return [self.index[name] for name in names]

    def group(self, prefix: str) -> list[str]:
        """List the columns whose names start with ``prefix/``, in their order; none is allowed."""
        return [name for name in self.index if name.startswith(prefix + "/")]
