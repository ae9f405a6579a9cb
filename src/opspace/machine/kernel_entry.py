"""What compiled functions Python calls, and with what."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from opspace.machine.answer_call import AnswerParts
from opspace.machine.field_table import RecordTable
from opspace.machine.sources import stamp

Argument: TypeAlias = type[float] | type[int] | type[np.ndarray] | RecordTable

_C: dict[Any, Any] = {float: ctypes.c_double, int: ctypes.c_int64, None: None}


class KernelEntry(NamedTuple):
    """A compiled function that Python calls, with a C interface.

    A number is passed as it is, an array of float64 by its address and its size, a record by the address
    of its handle.

    Attributes:
        module: Module of the kernel.
        name: Its name there.
        takes: Its arguments: float, int, ``numpy.ndarray``, or the table of a record.
        gives: What it returns: int or nothing; ``AnswerParts`` is an int that Python gets an answer of.
        releases: Whether other threads of Python may run while it does.
    """

    module: str
    name: str
    takes: tuple[Argument, ...]
    gives: type[int] | type[AnswerParts] | None = None
    releases: bool = False

    @property
    def symbol(self) -> str:
        """Name of the C function."""
        return f"opspace_{self.name}"

    def free_call(self, address: int) -> Any:
        """Return the C function at an address, called without the interpreter's lock."""
        given = (_C.get(one, ctypes.c_void_p) for one in self.takes)
        return ctypes.CFUNCTYPE(_C[self.gives], *given)(address)

    @property
    def layout(self) -> str:
        """Everything that the compiled function takes for granted of its arguments."""
        taken = (one.layout if isinstance(one, RecordTable) else one.__name__ for one in self.takes)
        return f"{self.module}.{self.name}({', '.join(taken)})"


def stamp_of(entries: Sequence[KernelEntry]) -> str:
    """Return what changes with everything that is frozen into the code of these functions."""
    return stamp("\n".join(entry.layout for entry in entries))[:32]
