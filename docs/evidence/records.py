"""Write docs/reference/records.md from the tables that the records themselves are made from."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from opspace.machine.field_table import LIVES, WRITERS, Field, RecordTable
from opspace.plan.records import SIZES, TABLES

PAGE = Path(__file__).parents[1] / "reference" / "records.md"
HEAD = """# Records of compiled code

What the compiled tick reads and writes: records of arrays, float64 or int64, contiguous, row by row.
`opspace.plan.records` and `opspace.robots.bodies` hold the tables that memory, handles and this page
follow from; `python docs/evidence/records.py` writes it. None of it is public: names and shapes may
change with any version.
"""


def page() -> str:
    """Give the whole page."""
    parts = [HEAD, listed("Sizes", "size", SIZES), listed("Who writes", "writer", WRITERS)]
    parts += [listed("How long it lives", "life", LIVES), *map(section, TABLES)]
    return "\n".join(parts)


def listed(title: str, what: str, meanings: dict[str, str]) -> str:
    """Write what words mean."""
    rows = [f"| `{word}` | {meaning} |" for word, meaning in meanings.items()]
    return "\n".join([f"## {title}", "", f"| {what} | meaning |", "| --- | --- |", *rows, ""])


def section(table: RecordTable) -> str:
    """Write the table of a record."""
    head = "| field | shape | meaning | unit | written by | lives |"
    rows = ["| --- | --- | --- | --- | --- | --- |", *map(row, table.fields), ""]
    return "\n".join([f"## {table.name}", "", table.meaning, "", head, *rows])


def row(field: Field) -> str:
    """Write one field."""
    if field.of is not None:
        return f"| `{field.name}` | | [{field.of.name}](#{field.of.name.lower()}) | | | |"
    shape = f"`({', '.join(map(str, field.shape))})`{' int' if field.dtype is np.int64 else ''}"
    meaning = field.meaning + (f"; {field.start:g} at first" if field.start else "")
    cells = f"`{field.name}`", shape, meaning, field.unit, field.writer, field.lives
    return f"| {' | '.join(cells)} |".replace("|  |", "| |")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
