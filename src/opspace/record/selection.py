"""Which recordings and which of their columns a list of words means."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from opspace.errors import InputError
from opspace.record.reader import Recording, find_recording, load


class Selection(NamedTuple):
    """Recordings and columns.

    Attributes:
        recordings: Recording by a title that tells it from the others.
        columns: Names of columns or groups; empty where none was named.
    """

    recordings: dict[str, Recording]
    columns: list[str]


def select(words: Sequence[str]) -> Selection:
    """Tell recordings from columns.

    The first word is a recording. A later word is a column where the first recording has such a
    column or group, else a recording where one lies there, else a column that is missing. A path
    such as ``./tau`` is never taken for a column.

    Args:
        words: Paths of recordings, names of columns and groups.

    Returns:
        What they mean, in their order.

    Raises:
        InputError: There is no word, or a recording is given twice.
        RecordingError: A path leads to no recording, or to a broken one.
        UnknownNameError: A word is neither a recording nor a column of any of them.
    """
    if not words:
        raise InputError("there is no recording to draw")
    paths, columns = [find_recording(words[0])], []
    first = load(paths[0])
    for word in words[1:]:
        if not _has(first, word) and _is_path(word):
            paths.append(find_recording(word))
        else:
            columns.append(word)
    recordings = [first, *(load(path) for path in paths[1:])]
    for column in columns:
        if not any(_has(recording, column) for recording in recordings):
            raise first.no_column(column, "recording, or column")
    return Selection(dict(zip(titles(paths), recordings, strict=True)), columns)


def titles(paths: Sequence[Path]) -> list[str]:
    """Name directories by as many of their last parts as it takes to tell them apart.

    Args:
        paths: The directories.

    Returns:
        A title for each.

    Raises:
        InputError: Two are the same.
    """
    parts = [path.resolve().parts for path in paths]
    for i, path in enumerate(paths):
        if parts[i] in parts[:i]:
            raise InputError(f"{path} is given twice")
    depth = 1
    while len({part[-depth:] for part in parts}) < len(parts):
        depth += 1
    return ["/".join(part[-depth:]) for part in parts]


def _has(recording: Recording, name: str) -> bool:
    return name in recording or name in recording.groups


def _is_path(word: str) -> bool:
    """Say whether a word leads to a recording, or to something that was taken for one."""
    return Path(word).exists()
