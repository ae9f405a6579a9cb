"""How everything here is compiled."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import IndexDataCacheFile
from numba.core.options import DefaultOptions

SOURCES = [
    path
    for part in ("law", "controller")
    for path in sorted((Path(__file__).parents[2] / part / "compiled").glob("*.py"))
] + [
    Path(__file__).parents[1] / "saturation.py",
    Path(__file__).parents[1] / "nearest.py",
    Path(__file__).parents[2] / "robots" / "dynamics.py",
]

FAST = {"reassoc", "contract"}
"""Sums may be taken in another order, four at a time; inf and nan stay what they are."""


UNCOUNTED: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
"""Nothing counts references to arrays: on small matrices that takes longer than the mathematics.
Whoever calls keeps the arrays; a function that makes some must count."""

GENERATION = 2
"""Raised when a type that arguments have moves or goes: what was kept before cannot be read then."""


def _stamp() -> tuple[float, int]:
    """Newest change and total size of everything that is compiled."""
    stats = [path.stat() for path in SOURCES]
    return max(s.st_mtime for s in stats), sum(s.st_size for s in stats)


STAMP = _stamp()


def jit(function: Callable[..., Any], *, counted: bool = False, nogil: bool = False) -> Any:
    """Compile a function at first use and keep it on disk; a division by zero gives inf or nan.

    What is kept counts as old when any compiled source has changed: by itself numba looks at the
    file of the function alone, not at those of the functions that it calls.

    Args:
        function: The function.
        counted: Whether it makes arrays; no compiled function may then call it.
        nogil: Whether other threads of Python may run while it does.
    """
    options = {} if counted else UNCOUNTED
    compiled: Any = numba.njit(
        cache=True, nogil=nogil, error_model="numpy", fastmath=FAST, **options
    )(function)
    cache = compiled._cache
    cache._cache_file = IndexDataCacheFile(
        cache_path=cache._cache_path,
        filename_base=f"{cache._impl.filename_base}-{GENERATION}",
        source_stamp=STAMP,
    )
    return compiled


def is_kept(compiled: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether the disk holds a function, compiled for arguments of these types on this processor."""
    cache = compiled._cache
    types = tuple(numba.typeof(argument) for argument in arguments)
    key = cache._index_key(types, compiled.targetctx.codegen())
    return key in cache._cache_file._load_index()
