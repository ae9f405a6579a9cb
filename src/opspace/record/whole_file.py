"""Files for others that are either complete or absent."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from opspace.errors import InputError


@contextmanager
def whole_file(path: Path, *, overwrite: bool = False) -> Iterator[Path]:
    """Give a place beside a file; what is written there becomes the file when all went well.

    Args:
        path: The file; its directory is made.
        overwrite: Replace a file that is already there.

    Yields:
        Path of an empty file with the same ending.

    Raises:
        InputError: The file is already there, or cannot be written.
    """
    if path.is_dir():
        raise InputError(f"{path} is a directory, not a file to write")
    if path.exists() and not overwrite:
        raise InputError(
            f"{path} already exists; choose another file (--out) or replace it (--overwrite)"
        )
    beside = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside.touch()
        yield beside
        beside.replace(path)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}") from error
    finally:
        _remove(beside)


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        # Where nothing can be written there is nothing to remove, and the first error counts.
        return
