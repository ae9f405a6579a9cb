"""Rows of a sweep on disk: one file for each finished run, so that none is lost and none is repeated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from opspace.errors import RecordingError
from opspace.record.format import read_json, write_json
from opspace.sweep.sweep_plan import SweepPlan

PLAN = "sweep.json"
ROWS = "rows"


class Store:
    """Directory of a sweep.

    A row is written to a file of its own that appears whole or not at all; what a killed sweep has
    finished is there when it goes on.

    Args:
        directory: The directory; made where it does not exist.
        plan: The sweep.

    Raises:
        RecordingError: The directory holds another sweep, or something else.
    """

    def __init__(self, directory: Path, plan: SweepPlan) -> None:
        self.directory = directory
        self._rows = directory / ROWS
        wanted = json.loads(json.dumps(plan.to_json()))
        path = directory / PLAN
        if path.exists():
            if read_json(path) != wanted:
                raise RecordingError(
                    f"{directory}: there is another sweep; choose another --out, or delete it"
                )
        elif directory.exists() and any(directory.iterdir()) and not self._rows.is_dir():
            raise RecordingError(f"{directory}: is not empty and no sweep")
        try:
            self._rows.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingError(f"{directory}: cannot be written: {error.strerror}") from error
        write_json(path, wanted)

    def finished(self) -> set[int]:
        """Numbers of the runs that have a row."""
        return {int(path.stem) for path in self._rows.glob("*.json") if path.stem.isdigit()}

    def add(self, row: dict[str, Any]) -> None:
        """Keep the row of a finished run."""
        write_json(self._rows / f"{row['index']:06d}.json", row)

    def rows(self) -> list[dict[str, Any]]:
        """Read all rows, in the order of their numbers."""
        return [read_json(self._rows / f"{index:06d}.json") for index in sorted(self.finished())]
