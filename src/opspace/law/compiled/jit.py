"""How everything here is compiled, and how compiled functions get their memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numba
from numba import types
from numba.experimental import structref

SOURCES = [
    path
    for part in ("law", "controller")
    for path in sorted((Path(__file__).parents[2] / part / "compiled").glob("*.py"))
] + [
    Path(__file__).parents[1] / "saturation.py",
    Path(__file__).parents[2] / "robots" / "dynamics.py",
]

FAST = {"reassoc", "contract"}
"""Sums may be taken in another order, four at a time; inf and nan stay what they are."""


def _stamp() -> tuple[float, int]:
    """Newest change and total size of everything that is compiled."""
    stats = [path.stat() for path in SOURCES]
    return max(s.st_mtime for s in stats), sum(s.st_size for s in stats)


STAMP = _stamp()


def jit(function: Callable[..., Any], *, nogil: bool = False) -> Any:
    """Compile a function at first use and keep it on disk; a division by zero gives inf or nan.

    What is kept counts as old when any compiled source has changed: by itself numba looks at the
    file of the function alone, not at those of the functions that it calls.

    Args:
        function: The function.
        nogil: Whether other threads of Python may run while it does.
    """
    compiled: Any = numba.njit(cache=True, nogil=nogil, error_model="numpy", fastmath=FAST)(
        function
    )
    compiled._cache._cache_file._source_stamp = STAMP
    return compiled


class Handle(types.StructRef):
    """Base of the types of handles, see `handle`."""

    def preprocess_fields(
        self, fields: Sequence[tuple[str, types.Type]]
    ) -> tuple[tuple[str, types.Type], ...]:
        """Forget that a field was given as a literal."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


def handle(kind: type, fields: Sequence[str]) -> type:
    """Make the compiled side of a record of arrays: one argument instead of many.

    Passing an array to a compiled function costs some 0.05 µs, a handle of any number of them as
    much as two.

    Args:
        kind: A class derived from `Handle`, registered with numba's structref.
        fields: Names of the arrays.

    Returns:
        The constructor, for use in compiled functions only.
    """
    proxy = type(kind.__name__, (structref.StructRefProxy,), {})
    structref.define_constructor(proxy, kind, fields)
    structref.define_boxing(kind, proxy)
    return proxy
