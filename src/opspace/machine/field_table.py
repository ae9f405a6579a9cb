"""One table describes a record of arrays: its memory, its handle and its documents follow from it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from opspace.machine.lanes import LINE, whole
from opspace.machine.record import WORD, Handle, address_of

WRITERS = {
    "robot": "whoever updates the robot: its library, or the tick where it computes the dynamics",
    "plan": "the layout of a stack, at every change of it",
    "refresh": "the layout, at every tick in which a target, a gain or a task of the user's moves",
    "tick": "compiled code, at every tick",
    "caller": "whoever calls the compiled function",
}
LIVES = {
    "robot": "as long as the robot",
    "plan": "until the stack changes",
    "kept": "from tick to tick; a new plan takes it over",
    "reported": "until the next tick, in one block of which the report keeps a copy",
    "tick": "until the next tick",
    "scratch": "within a tick",
}

WHOLE = "whole "
"""Begins sizes that are rounded up to whole vectors, see `opspace.machine.lanes`."""


class Field(NamedTuple):
    """One array of a record, or a record in it.

    Attributes:
        name: Its name in Python and in compiled code.
        shape: Sizes by name; each is a number, a size, or a sum of products, as in ``"2 rows + 1"``,
            which ``"whole 2 rows + 1"`` rounds up.
        meaning: What it holds.
        unit: Of its numbers; empty for whole and pure numbers, and where the meaning says more.
        writer: Who writes it, one of `WRITERS`.
        lives: How long that holds, one of `LIVES`.
        dtype: Float64 or int64.
        start: What it is filled with at first.
        of: Table of the record that it is.
    """

    name: str
    shape: tuple[int | str, ...]
    meaning: str
    unit: str = ""
    writer: str = "tick"
    lives: str = "scratch"
    dtype: type = np.float64
    start: float = 0.0
    of: RecordTable | None = None


class Record:
    """The arrays of a record as attributes.

    Args:
        table: What describes them.
        arrays: Each of its fields.
    """

    def __init__(self, table: RecordTable, arrays: Mapping[str, np.ndarray | Record]) -> None:
        self._table = table
        self.__dict__.update(arrays)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    def __iter__(self) -> Iterator[np.ndarray | Record]:
        return (self.__dict__[field.name] for field in self._table.fields)

    def __repr__(self) -> str:
        return f"{self._table.name}({', '.join(field.name for field in self._table.fields)})"

    def handle(self) -> Handle:
        """Make the handle with which compiled functions reach the record."""
        found = ((field.name, self.__dict__[field.name]) for field in self._table.fields)
        fields = {name: x.handle() if isinstance(x, Record) else x for name, x in found}
        return Handle(self._table.name, fields)


class Block:
    """One piece of memory that arrays are cut from, so that one copy keeps all of them.

    Args:
        memory: Float64 numbers, one after the other.
    """

    def __init__(self, memory: np.ndarray) -> None:
        self.memory = memory
        self._used = 0

    def take(self, shape: tuple[int, ...], dtype: type) -> np.ndarray:
        """Cut the next array."""
        size = math.prod(shape)
        part = self.memory[self._used : self._used + size].view(dtype).reshape(shape)
        self._used += size
        return part


def _lined_up(shape: tuple[int, ...], dtype: type) -> np.ndarray:
    """Make an array that begins where a line of the cache does, at twice the cost of any other."""
    size = math.prod(shape)
    memory = np.zeros(size + LINE // WORD, dtype)
    skipped = -address_of(memory) % LINE // WORD
    return memory[skipped : skipped + size].reshape(shape)


class _Extents(dict[Any, Any]):
    """Sizes by name, and what has been worked out from them: sums of products, and shapes."""

    def __missing__(self, size: str | tuple[int | str, ...]) -> int | tuple[int, ...]:
        if isinstance(size, tuple):
            found = tuple([one if type(one) is int else self[one] for one in size])
        elif size.startswith(WHOLE):
            found = whole(self[size.removeprefix(WHOLE)])
        elif size.isidentifier():
            raise ValueError(f"size {size!r} is not known, only {', '.join(map(str, self))}")
        else:
            found = 0
            for factor, names in _terms(size):
                found += factor * math.prod([self[name] for name in names])
        self[size] = found
        return found


@cache
def _terms(size: str) -> list[tuple[int, list[str]]]:
    """Read a sum of products: a number and names each."""
    words = [term.split() for term in size.split("+")]
    numbers = [[int(word) for word in term if word.isdigit()] for term in words]
    names = [[word for word in term if not word.isdigit()] for term in words]
    return [(math.prod(n), rest) for n, rest in zip(numbers, names, strict=True)]


class RecordTable:
    """All fields of a record.

    Args:
        name: Name of the record.
        meaning: What it is.
        fields: Its fields.
    """

    def __init__(self, name: str, meaning: str, *fields: Field) -> None:
        self.name = name
        self.meaning = meaning
        self.fields = fields

    def make(
        self, sizes: Mapping[str, int], given: Mapping[str, np.ndarray | Record] | None = None
    ) -> Record:
        """Make a record.

        Args:
            sizes: Sizes by name. Those that are not there are taken from the arrays that are given.
            given: Arrays that the record shares with others, and the records in it.

        Returns:
            The record; what is not given is new.

        Raises:
            ValueError: An array that is given has another shape or type than the table says, or
                does not belong to the record, or a record in it is missing.
        """
        given = given or {}
        known = _Extents(sizes)
        for name, value in given.items():
            if name not in self._by_name:
                raise ValueError(f"{self.name} has no {name!r}, only {', '.join(self._by_name)}")
            self._check(self._by_name[name], value, known)
        arrays: dict[str, Any] = dict(given)
        for field in self.fields:
            if field.name not in given:
                make = _lined_up if field.name in self._padded else np.zeros
                arrays[field.name] = make(known[field.shape], field.dtype)
                if field.start or field.of:
                    self._begin(field, arrays[field.name])
        return Record(self, arrays)

    def reported(self, sizes: Mapping[str, int], block: Block) -> dict[str, np.ndarray]:
        """Cut what is reported, in the same order from every block."""
        known = _Extents(sizes)
        return {f.name: block.take(known[f.shape], f.dtype) for f in self._reported}

    def reported_size(self, sizes: Mapping[str, int]) -> int:
        """Numbers that `reported` takes."""
        known = _Extents(sizes)
        return sum(math.prod(known[field.shape]) for field in self._reported)

    @cached_property
    def layout(self) -> str:
        """What compiled code takes for granted: the fields in order, their types and dimensions."""
        fields = (
            f"{f.name}: {f.of.layout if f.of else f'{np.dtype(f.dtype)}{len(f.shape)}'}"
            for f in self.fields
        )
        return f"{self.name}({', '.join(fields)})"

    @cached_property
    def _by_name(self) -> dict[str, Field]:
        return {field.name: field for field in self.fields}

    @cached_property
    def _padded(self) -> set[str]:
        sizes = ((field.name, field.shape[-1]) for field in self.fields if field.shape)
        return {name for name, size in sizes if type(size) is str and size.startswith(WHOLE)}

    @cached_property
    def _reported(self) -> list[Field]:
        return [field for field in self.fields if field.lives == "reported"]

    def _begin(self, field: Field, array: np.ndarray) -> None:
        if field.of is not None:
            raise ValueError(f"{self.name}.{field.name} must be given: a {field.of.name}")
        array.fill(field.start)

    def _check(self, field: Field, value: np.ndarray | Record, sizes: _Extents) -> None:
        """Hold what is given against the table; a size that is not known yet is what it says."""
        if isinstance(value, Record):
            if field.of is None or value._table.name != field.of.name:
                raise ValueError(f"{self.name}.{field.name} is {value!r}, not {field}")
            return
        if value.ndim == len(field.shape):
            for size, extent in zip(field.shape, value.shape, strict=True):
                if type(size) is str and size not in sizes and size.isidentifier():
                    sizes[size] = extent
        same = value.dtype.type is field.dtype and value.shape == sizes[field.shape]
        if not same or field.of is not None:
            raise ValueError(
                f"{self.name}.{field.name} has type {value.dtype} and shape {value.shape}, "
                f"not those of {field} with {sizes}"
            )
