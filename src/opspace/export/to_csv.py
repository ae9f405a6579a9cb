"""A recording as comma-separated values."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from opspace.record import Recording

_ROWS_AT_ONCE = 1000


def write(recording: Recording, path: Path) -> Iterator[tuple[int, int]]:
    """Write a header ``name [unit]`` and a line per row.

    Numbers have as many digits as it takes to read the same bits back; those that are not finite
    are ``nan``, ``inf`` and ``-inf``.

    Args:
        recording: The run.
        path: File to write.

    Yields:
        How many rows are written, and of how many.
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([f"{column.name} [{column.unit}]" for column in recording.columns])
        for start in range(0, len(recording), _ROWS_AT_ONCE):
            rows = recording.data[start : start + _ROWS_AT_ONCE]
            writer.writerows(rows.tolist())
            yield start + len(rows), len(recording)
