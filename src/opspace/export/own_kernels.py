"""Kernels for one exported controller alone."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Set as AbstractSet

import numpy as np

from opspace.controller.exported import Exported
from opspace.machine.field_table import Record, RecordTable
from opspace.machine.freeze import Frozen
from opspace.plan.records import TICK

KERNELS_IN_C = ("tick", "gravity", "learn")
VECTORISE_FROM = 14
"""Joints from which on vectorised loops are faster than plain ones."""
WRITTEN = {"variable"}
"""Arrays of a plan that the C source writes."""
MOVED = {"slots", "slot_on", "slot_off", "slot_place", "space.first_kept"}
"""Those that it writes where tasks move to other levels."""


def frozen(found: Exported) -> Frozen:
    """Tell what never changes of an exported controller: all sizes, its robot, options and limits."""
    image = found.image
    arrays = list(arrays_of(TICK, found.plan.tick, WRITTEN | MOVED if found.moves else WRITTEN))
    changing = np.zeros(image.words.size, bool)
    for name, array, stays in arrays:
        if name in image.first and not stays:
            changing[image.first[name] : image.first[name] + array.size] = True
    parts = {
        (image.first[name], array.size)
        for name, array, stays in arrays
        if stays and name in image.first
    }
    fixed = [
        (first, size) for first, size in sorted(parts) if not changing[first : first + size].any()
    ]
    roots = {"Tick": image.handle}
    if "integrals" in image.beside:
        roots["Integrals"] = image.beside["integrals"]
    return Frozen(
        KERNELS_IN_C,
        image.words,
        image.addresses,
        image.handles,
        roots,
        tuple(fixed),
        found.plan.n >= VECTORISE_FROM,
    )


def arrays_of(
    table: RecordTable, record: Record, written: AbstractSet[str], before: str = ""
) -> Iterator[tuple[str, np.ndarray, bool]]:
    """List all arrays by name, and whether each stays what it is.

    Args:
        table: What describes the record.
        record: The record.
        written: Names of arrays of a plan that somebody writes.
        before: What the names begin with.
    """
    for field in table.fields:
        name, value = before + field.name, getattr(record, field.name)
        if field.of is not None:
            yield from arrays_of(field.of, value, written, f"{name}.")
            continue
        fixed = field.writer == field.lives == "plan" or field.writer == field.lives == "robot"
        yield name, value, fixed and name not in written and not name.startswith("stance.")
