"""The memory of a tick as one piece that may lie anywhere, for programs without Python."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from opspace.machine.lanes import LINE
from opspace.machine.record import WORD, Handle


class Image(NamedTuple):
    """All arrays and handles of a record in one row of words.

    Whoever puts the words somewhere adds the place of the first one, in bytes, to each word that is
    an address.

    Attributes:
        words: (N,) uint64, the contents; an address counts words from the first one.
        addresses: Which words are addresses.
        handles: Word from which on there are handles.
        handle: Word where the handle of the record begins.
        beside: The same of the others, by name.
        first: Word where each array of the record begins, by name; those of a record in it, or beside
            it, have its name and a dot before theirs. Those without numbers are not there.
    """

    words: np.ndarray
    addresses: np.ndarray
    handles: int
    handle: int
    beside: dict[str, int]
    first: dict[str, int]


def image(handle: Handle, **beside: Handle) -> Image:
    """Copy everything that handles lead to; what shares memory shares it in the copy."""
    arrays = (array for one in (handle, *beside.values()) for array in _arrays(one))
    regions = _regions(sorted({_extent(array) for array in arrays}))
    words: list[np.ndarray] = []
    begins: dict[int, int] = {}
    used = 0
    for start, end in regions:
        # As far from a line of the cache as it is now, if the first word begins one.
        gap = (start // WORD - used) % (LINE // WORD)
        words += [np.zeros(gap, np.uint64), _content(start, end)]
        begins[start] = used + gap
        used += gap + words[-1].size
    starts, handles = np.array(list(begins), np.uintp), used

    def place(array: np.ndarray) -> int:
        address, _ = _extent(array)
        start = int(starts[np.searchsorted(starts, address, side="right") - 1])
        return begins[start] + (address - start) // WORD

    addresses: list[int] = []

    def put(one: Handle) -> int:
        """Write the words of a handle after those that it leads to."""
        nonlocal used
        row: list[int] = []
        relative: list[int] = []
        for field in one.fields.values():
            if isinstance(field, Handle):
                relative.append(len(row))
                row.append(put(field))
                continue
            if field.size:
                relative.append(len(row))
            row += [place(field) if field.size else 0, *field.shape]
        begin, used = used, used + len(row)
        words.append(np.array(row, np.uint64))
        addresses.extend(begin + i for i in relative)
        return begin

    begin, others = put(handle), {name: put(one) for name, one in beside.items()}
    named = [*_named(handle), *(x for name, one in beside.items() for x in _named(one, f"{name}."))]
    found = {name: place(field) for name, field in named if field.size}
    return Image(np.concatenate(words), np.array(sorted(addresses)), handles, begin, others, found)


def _arrays(handle: Handle) -> Iterator[np.ndarray]:
    for field in handle.fields.values():
        if isinstance(field, Handle):
            yield from _arrays(field)
        elif field.size:
            yield field


def _named(handle: Handle, before: str = "") -> Iterator[tuple[str, np.ndarray]]:
    for name, field in handle.fields.items():
        if isinstance(field, Handle):
            yield from _named(field, f"{before}{name}.")
        else:
            yield before + name, field


def _extent(array: np.ndarray) -> tuple[int, int]:
    """Return where an array begins and ends."""
    begin = array.__array_interface__["data"][0]
    return begin, begin + array.nbytes


def _regions(extents: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Join what overlaps."""
    found: list[tuple[int, int]] = []
    for begin, end in extents:
        if found and begin < found[-1][1]:
            found[-1] = found[-1][0], max(end, found[-1][1])
        else:
            found.append((begin, end))
    return found


def _content(begin: int, end: int) -> np.ndarray:
    return np.frombuffer(ctypes.string_at(begin, end - begin), np.uint64)
