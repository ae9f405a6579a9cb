"""Which formats there are, and writing one of them whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

from opspace.errors import unknown_name
from opspace.record import Recording
from opspace.record.whole_file import whole_file

FORMATS = {"mcap": ".mcap", "rerun": ".rrd", "csv": ".csv"}
"""Ending of the files of each format."""

Progress = Callable[[int, int], None]
"""Is told how many rows are written, and of how many."""


def export(
    recording: Recording,
    path: Path | str,
    to: str | None = None,
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Write every row and column of a recording as a file of another program.

    Args:
        recording: The run.
        path: File to write.
        to: ``mcap``, ``rerun`` or ``csv``; None takes what the ending of the file says.
        overwrite: Replace a file that is already there.
        progress: Is told from time to time how many steps are done, and of how many.

    Returns:
        The path.

    Raises:
        UnknownNameError: There is no such format.
        MissingExtraError: What writes the format is not installed.
        InputError: The file is there already or cannot be written, or the format cannot hold the
            recording.
    """
    path = Path(path)
    to = format_of(path) if to is None else to
    if to not in FORMATS:
        raise unknown_name("format", to, FORMATS)
    write: Callable[[Recording, Path], Iterator[tuple[int, int]]]
    write = import_module(f"opspace.export.to_{to}").write
    with whole_file(path, overwrite=overwrite) as unfinished:
        for done, of in write(recording, unfinished):
            if progress:
                progress(done, of)
    return path


def format_of(path: Path) -> str:
    """Tell the format of a file by its ending.

    Args:
        path: The file.

    Returns:
        Key of `FORMATS`.

    Raises:
        UnknownNameError: No format has this ending.
    """
    for name, ending in FORMATS.items():
        if path.suffix.lower() == ending:
            return name
    raise unknown_name(f"ending of {path}", path.suffix, FORMATS.values())
