"""How long vectors are, and where they should begin: rows are padded with zeros to whole ones."""

from __future__ import annotations

LANES = 8
"""Numbers in a vector. Most arms have no more joints: a loop over them ends with its first turn."""

LINE = 64
"""Bytes of a line of the cache: a vector that does not lie across two of them is read at once."""


def whole(count: int) -> int:
    """Numbers in the whole vectors that hold so many."""
    return (count + LANES - 1) & -LANES


def whole_before(count: int) -> int:
    """Numbers in the whole vectors that so many fill."""
    return count & -LANES
