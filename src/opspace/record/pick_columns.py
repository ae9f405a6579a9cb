"""Takes columns out of rows that may be more than the memory holds."""

from __future__ import annotations

import mmap

import numpy as np

_AT_ONCE = 2**22
"""How many numbers are looked at before their memory is given back."""


def pick_columns(rows: np.ndarray, places: list[int]) -> np.ndarray:
    """Copy some columns.

    A column lies in every page of the file. Of a map, the pages that have been read are given back
    block by block; they would count as memory of this process as long as the map exists.

    Args:
        rows: (T, number of columns), perhaps a `numpy.memmap`.
        places: Which columns, k of them.

    Returns:
        (T, k) an array of its own.
    """
    if not isinstance(rows, np.memmap):
        return rows[:, places]
    picked = np.empty((len(rows), len(places)))
    step = max(1, _AT_ONCE // max(1, rows.shape[1]))
    mapped = rows._mmap  # pyright: ignore[reportAttributeAccessIssue] - NumPy gives it no other name
    for start in range(0, len(rows), step):
        picked[start : start + step] = rows[start : start + step, places]
        if hasattr(mmap, "MADV_DONTNEED"):
            mapped.madvise(mmap.MADV_DONTNEED)
    return picked
