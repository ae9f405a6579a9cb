"""Tables that fit a terminal without cutting a number or a name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

GAP = 3
"""Columns of the terminal between two columns of a table."""


class Part(NamedTuple):
    """Some columns of a table side by side.

    Attributes:
        heads: Their heads.
        rows: Their cells.
        widths: Their widths; longer cells go on in a new line between two words.
    """

    heads: list[str]
    rows: list[list[str]]
    widths: list[int]


def fit_table(heads: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[Part]:
    """Lay a table out for a terminal.

    Columns first become as narrow as their longest word; what still finds no place goes into
    further parts below, each with the first column again.

    Args:
        heads: Heads of the columns.
        rows: Cells of each row.
        width: Characters in a line.

    Returns:
        The parts from top to bottom.
    """
    cells = [[head, *(row[i] for row in rows)] for i, head in enumerate(heads)]
    least = [max((len(word) for cell in c for word in cell.split()), default=0) for c in cells]
    parts = []
    for columns in _side_by_side(least, width):
        widths = [max(map(len, cells[i])) for i in columns]
        while sum(widths) + GAP * (len(widths) - 1) > width:
            spare = [w - least[i] for w, i in zip(widths, columns, strict=True)]
            if not any(spare):  # one word is longer than a line
                break
            widest = max(range(len(widths)), key=lambda k: (spare[k] > 0) * widths[k])
            widths[widest] -= 1
        parts.append(
            Part([heads[i] for i in columns], [[row[i] for i in columns] for row in rows], widths)
        )
    return parts


def _side_by_side(least: Sequence[int], width: int) -> list[list[int]]:
    """Gather columns, from left to right, into as few parts as can be."""
    parts, used = [[0]], least[0]
    for i in range(1, len(least)):
        if used + GAP + least[i] > width and len(parts[-1]) > 1:
            parts.append([0])
            used = least[0]
        parts[-1].append(i)
        used += GAP + least[i]
    return parts
