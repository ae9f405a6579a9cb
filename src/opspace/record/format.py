"""What a recording consists of: file names, columns, and how a run can end.

A recording is a directory:

- ``header.json``: columns with units, package versions, and what the caller put in (the resolved
  scenario, the seed, the tick). The same run on the same versions gives the same bytes.
- ``data.f64``: one row of little-endian float64 per tick, in the order of the columns.
- ``end.json``: how the run ended. Absent when the process was killed or is still running.
- ``meta.json``: what differs between two runs of the same thing: the time and the machine.
"""

from __future__ import annotations

import json
import os
import platform
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Literal, get_args

from opspace.errors import InputError, RecordingError

HEADER = "header.json"
DATA = "data.f64"
END = "end.json"
META = "meta.json"
FILES = (HEADER, END, META, DATA)

FORMAT = "opspace-recording"
FORMAT_VERSION = 1
DTYPE = "<f8"

Ended = Literal["completed", "stopped", "interrupted", "crashed", "unfinished"]
"""``unfinished`` is never written: it is what a recording without ``end.json`` says of itself."""

_DISTRIBUTIONS = {
    "opspace": "opspace",
    "numpy": "numpy",
    "scipy": "scipy",
    "pinocchio": "pin",
    "mujoco": "mujoco",
    "ruckig": "ruckig",
}


@dataclass(frozen=True)
class Column:
    """One recorded quantity.

    Attributes:
        name: Path-like name, for example ``tau/joint1``; what joints and tasks are called stands in
            it as it is.
        unit: SI unit, ``1`` for a number without one.
        description: What it is, in words.
    """

    name: str
    unit: str
    description: str = ""

    def __post_init__(self) -> None:
        if not all(map(str.strip, parts_of(self.name))) or not _fits_a_line(self.name):
            raise InputError(
                f"column name {self.name!r} must be words on one line, after a group and a slash or "
                "alone"
            )
        if not (self.unit.strip() and self.unit.isprintable()):
            raise InputError(f"column {self.name!r} needs a unit ('1' for a number without one)")


def parts_of(name: str) -> tuple[str, ...]:
    """Take the name of a column apart.

    Args:
        name: The name, such as ``tasks/position/error/0``.

    Returns:
        The groups that it is in, from the outside to the inside, and its own name in the last. A
        joint that is called ``/arm/joint1`` is one part.
    """
    group, slash, rest = name.partition("/")
    if not slash:
        return (group,)
    inner = rest.split("/")
    return (group, *inner) if all(map(str.strip, inner)) else (group, rest)


def _fits_a_line(text: str) -> bool:
    """Whether a text has no sign that ends a line or is none."""
    return all(unicodedata.category(sign) not in ("Cc", "Zl", "Zp", "Cs") for sign in text)


@dataclass(frozen=True)
class End:
    """How a recording ended.

    Attributes:
        how: ``completed``, ``stopped`` (by a guard of the run), ``interrupted`` (Ctrl-C),
            ``crashed`` (an exception) or ``unfinished`` (killed, or still running).
        reason: The guard's or the exception's words; empty when there is nothing to say.
        rows: Number of complete rows.
    """

    how: Ended
    reason: str
    rows: int

    def __post_init__(self) -> None:
        if self.how not in get_args(Ended):
            raise InputError(f"ended {self.how!r} is not one of {', '.join(get_args(Ended))}")


def check_columns(columns: tuple[Column, ...]) -> None:
    """Refuse a set of columns that could not be told apart.

    Args:
        columns: The columns in their order on disk.

    Raises:
        InputError: There is no column, or two share a name.
    """
    if not columns:
        raise InputError("a recording needs at least one column")
    seen: set[str] = set()
    for column in columns:
        if column.name in seen:
            raise InputError(f"column {column.name!r} is given twice")
        seen.add(column.name)


def package_versions() -> dict[str, str]:
    """Name the version of everything that the numbers of a run depend on.

    Returns:
        Version by package name, ``not installed`` for an absent optional one.
    """
    found = {"python": platform.python_version()}
    for package, distribution in _DISTRIBUTIONS.items():
        try:
            found[package] = metadata.version(distribution)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    return found


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file that is either complete or absent.

    Args:
        path: Where it goes; a file already there is replaced.
        content: What it says, in JSON's own types.

    Raises:
        InputError: The content cannot be said in JSON.
        RecordingError: The file cannot be written.
    """
    try:
        text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InputError(f"{path.name} cannot hold this content as JSON: {error}") from error
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with temporary.open("w", encoding="utf-8") as file:
            file.write(text + "\n")
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise RecordingError(f"{path} cannot be written: {error.strerror}") from error


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object of a recording.

    Args:
        path: The file.

    Returns:
        Its content.

    Raises:
        RecordingError: The file is missing, unreadable or not a JSON object.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise RecordingError(f"{path} is not valid JSON: {error}") from error
    if not isinstance(content, dict):
        raise RecordingError(f"{path} does not hold a JSON object")
    return content
