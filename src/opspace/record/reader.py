"""Reads a recording back, whole or cut short."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from opspace.errors import (
    InputError,
    RecordingError,
    UnknownNameError,
    missing_extra,
    unknown_name,
)
from opspace.record import format as fmt
from opspace.record.pick_columns import pick_columns

if TYPE_CHECKING:
    import pandas as pd

LARGE = 64 * 2**20
"""Size of a recording's numbers beyond which they stay on the disk until they are asked for, bytes."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording:
    """The numbers of a run, by column name.

    Attributes:
        directory: Where it was read from.
        columns: The columns in their order on disk.
        header: Everything in ``header.json``: ``scenario``, ``seed``, ``versions``, ...
        meta: When and where it was recorded.
        ended: How the run ended.
        data: (T, number of columns) read-only; beyond `LARGE` a map of the file, which then must
            stay as it is.
    """

    directory: Path
    columns: tuple[fmt.Column, ...]
    header: Mapping[str, Any]
    meta: Mapping[str, Any]
    ended: fmt.End
    data: np.ndarray
    _index: Mapping[str, int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        index = {column.name: i for i, column in enumerate(self.columns)}
        object.__setattr__(self, "_index", index)

    @property
    def names(self) -> tuple[str, ...]:
        """The column names in their order on disk."""
        return tuple(self._index)

    @property
    def groups(self) -> tuple[str, ...]:
        """The names of groups of columns: ``tasks/position/error/0`` lies in three."""
        groups: dict[str, None] = {}
        for name in self._index:
            parts = name.split("/")
            groups.update(("/".join(parts[:i]), None) for i in range(1, len(parts)))
        return tuple(groups)

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of each column."""
        return {column.name: column.unit for column in self.columns}

    def unit_of(self, group: str) -> str:
        """Return the unit of a group; where its columns have several, all of them in their order.

        Raises:
            UnknownNameError: There is no such group.
        """
        units = self.units
        return ", ".join(dict.fromkeys(units[name] for name in self.members(group)))

    @property
    def t(self) -> np.ndarray:
        """(T,) time [s]: the column ``t``."""
        return self["t"]

    def __len__(self) -> int:
        return len(self.data)

    def __getstate__(self) -> dict[str, Any]:
        """Be pickled with the numbers, so that it can be read where the file is not."""
        return {
            **self.__dict__,
            "data": np.asarray(self.data),
            "header": dict(self.header),
            "meta": dict(self.meta),
        }

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def __iter__(self) -> Iterator[str]:
        """Give the names of the columns, as tables of other libraries do."""
        return iter(self._index)

    def __getitem__(self, name: str) -> np.ndarray:
        """Look up one column.

        Args:
            name: Column name, for example ``q/joint1``.

        Returns:
            (T,) read-only; a view, or of a recording beyond `LARGE` a copy.

        Raises:
            UnknownNameError: There is no such column.
        """
        try:
            place = self._index[name]
        except KeyError:
            raise unknown_name(f"column of {self.directory}", name, self.names) from None
        if not isinstance(self.data, np.memmap):
            return self.data[:, place]
        column = pick_columns(self.data, [place])[:, 0]
        column.setflags(write=False)
        return column

    def row(self, index: int) -> dict[str, float]:
        """Read one tick.

        Args:
            index: Its number; negative ones count from the end.

        Returns:
            What was recorded, by column name.
        """
        return dict(zip(self._index, self.data[index].tolist(), strict=True))

    def members(self, prefix: str) -> tuple[str, ...]:
        """List the columns of a group.

        Args:
            prefix: Group name, for example ``q`` or ``tasks/position/error``.

        Returns:
            The names that start with ``prefix/``, in their order on disk.

        Raises:
            UnknownNameError: No column lies in such a group.
        """
        found = tuple(name for name in self._index if name.startswith(prefix + "/"))
        if not found:
            raise unknown_name(f"column group of {self.directory}", prefix, self.groups)
        return found

    def group(self, prefix: str) -> np.ndarray:
        """Gather the columns of a group.

        Args:
            prefix: Group name, for example ``q`` or ``tasks/position/error``.

        Returns:
            (T, k) in the order of ``members(prefix)``.

        Raises:
            UnknownNameError: No column lies in such a group.
        """
        return pick_columns(self.data, [self._index[name] for name in self.members(prefix)])

    def no_column(self, name: str, kind: str = "column") -> UnknownNameError:
        """Build the error for what is neither a column nor a group, listing groups before columns.

        Args:
            name: The name as given.
            kind: What it should have been.

        Returns:
            The error, to be raised by the caller.
        """
        alone = [column for column in self.names if "/" not in column]
        listed = [*(group for group in self.groups if group.count("/") <= 1), *alone]
        choices = [*self.groups, *self.names]
        return unknown_name(f"{kind} of {self.directory}", name, choices, listed)

    def to_pandas(self) -> pd.DataFrame:
        """Copy the recording into a table of pandas.

        Returns:
            A row per tick and a column per recorded quantity, by its name, without ``t``: the time
            is the index ``t [s]``. ``frame.attrs["units"]`` is the unit by column.

        Raises:
            MissingExtraError: pandas is not installed.
            UnknownNameError: The recording has no column ``t``.
        """
        try:
            import pandas as pd  # noqa: PLC0415 - optional, and slow to import
        except ImportError:
            raise missing_extra("pandas", "export") from None
        index = pd.Index(self.t.copy(), name=f"t [{self.units['t']}]")
        names = [name for name in self.names if name != "t"]
        values = pick_columns(self.data, [self._index[name] for name in names])
        frame = pd.DataFrame(values, index=index, columns=pd.Index(names, dtype=object))
        frame.attrs["units"] = {name: self.units[name] for name in names}
        return frame


def load(directory: Path | str) -> Recording:
    """Read a recording.

    A recording without ``end.json`` was cut short: the row that was being written is dropped.

    Args:
        directory: The recording's directory, or one of the recording's files in it.

    Returns:
        The recording.

    Raises:
        RecordingError: There is no recording, or a file is missing, corrupt or of another format.
    """
    directory = find_recording(directory)
    header = fmt.read_json(directory / fmt.HEADER)
    columns = _columns(directory / fmt.HEADER, header)
    data = _read_data(directory / fmt.DATA, len(columns))
    ended = _read_end(directory / fmt.END, len(data))
    meta = fmt.read_json(directory / fmt.META) if (directory / fmt.META).exists() else {}
    return Recording(
        directory=directory,
        columns=columns,
        header=MappingProxyType(header),
        meta=MappingProxyType(meta),
        ended=ended,
        data=data,
    )


def find_recording(path: Path | str) -> Path:
    """Find the directory of the recording that a path means.

    Args:
        path: The directory, or a file of the recording in it.

    Returns:
        The directory.

    Raises:
        RecordingError: There is no recording; the message names those just below, if any.
    """
    path = Path(path)
    if path.is_file() and path.name in fmt.FILES:
        path = path.parent
    if (path / fmt.HEADER).exists():
        return path
    if not path.exists():
        raise RecordingError(f"{path}: there is no such directory")
    what = f"is not a recording: it is no directory with a {fmt.HEADER} in it"
    below = sorted(str(header.parent) for header in path.glob(f"*/{fmt.HEADER}"))
    hint = f"; recordings below it: {', '.join(below)}" if below else ""
    raise RecordingError(f"{path} {what}{hint}")


def _columns(path: Path, header: Mapping[str, Any]) -> tuple[fmt.Column, ...]:
    if header.get("format") != fmt.FORMAT:
        raise RecordingError(f"{path} is not the header of a recording")
    version = header.get("format_version")
    if version != fmt.FORMAT_VERSION:
        raise RecordingError(
            f"{path} has format version {version!r}; this opspace reads {fmt.FORMAT_VERSION}"
        )
    try:
        columns = tuple(fmt.Column(**column) for column in header["columns"])
        fmt.check_columns(columns)
    except (KeyError, TypeError, AttributeError, InputError) as error:
        raise RecordingError(f"{path} does not list its columns properly: {error}") from error
    return columns


def _read_data(path: Path, width: int) -> np.ndarray:
    try:
        size = path.stat().st_size
        shape = (size // (width * np.dtype(fmt.DTYPE).itemsize), width)
        if size > LARGE:
            return np.memmap(path, fmt.DTYPE, "r", shape=shape)
        # Made from bytes, the array is read-only.
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        raise RecordingError(f"{path} cannot be read: {error}") from error
    return np.frombuffer(content, dtype=fmt.DTYPE, count=shape[0] * width).reshape(shape)


def _read_end(path: Path, rows: int) -> fmt.End:
    if not path.exists():
        return fmt.End("unfinished", "the process was killed or is still running", rows)
    content = fmt.read_json(path)
    try:
        end = fmt.End(content["ended"], content["reason"], content["rows"])
    except (KeyError, InputError) as error:
        raise RecordingError(f"{path} does not say how the run ended: {error}") from error
    if end.rows != rows:
        raise RecordingError(
            f"{path.with_name(fmt.DATA)} holds {rows} rows where {path.name} says {end.rows}"
        )
    return end
