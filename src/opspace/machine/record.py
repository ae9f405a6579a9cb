"""How compiled functions get their memory: a record of arrays as one argument.

Passing an array to a compiled function costs some 0.05 µs, and each use of one that belongs to
Python counts a reference, which costs as much as the mathematics on a small matrix. A handle is an
address: arrays are read from it where they are used, and are never counted. Whoever made it keeps them.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any

import numpy as np

WORD = 8
WORDS = (np.dtype(np.float64), np.dtype(np.int64))


class Handle:
    """A record of arrays, for compiled functions only.

    Its memory is a row of words: of an array its address and its extents, of a handle its address.

    Attributes:
        kind: Name of the record.
        fields: Arrays and handles by name.
        address: Where the words begin; what compiled functions take.

    Args:
        kind: Name of the record.
        fields: Arrays, contiguous and writable, and other handles.
    """

    __slots__ = ("_words", "address", "fields", "kind")

    def __init__(self, kind: str, fields: Mapping[str, np.ndarray | Handle]) -> None:
        self.kind = kind
        self.fields = dict(fields)
        words: list[int] = []
        for name, field in fields.items():
            if isinstance(field, Handle):
                words.append(field.address)
                continue
            if not field.flags.carray or field.dtype not in WORDS:
                raise ValueError(
                    f"{kind}.{name} must be contiguous, aligned, writable and of words"
                )
            words += [address_of(field), *field.shape]
        self._words = np.array(words, np.uintp)
        self.address = address_of(self._words)


def address_of(array: np.ndarray) -> int:
    """Where an array begins, in a quarter of the time that its own attributes take to tell."""
    buffer: Any = array
    return ctypes.addressof(ctypes.c_char.from_buffer(buffer)) if array.size else 0
