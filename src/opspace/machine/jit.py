"""How everything here is compiled."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import types
from numba.core.options import DefaultOptions

from opspace.machine.kept_code import compile_and_keep

FAST = {"reassoc", "contract"}
"""Sums may be taken in another order, four at a time; inf and nan stay what they are."""


UNCOUNTED: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
"""Nothing counts references to arrays: on small matrices that takes longer than the mathematics.
Whoever calls keeps the arrays; a function that makes some must count."""

GENERATION = 2
"""Raised when a type that arguments have moves or goes: what was kept before cannot be read then."""


PACKAGE = Path(__file__).parents[1]
IMPORTED = re.compile(
    r"^(?:from (opspace[.\w]*) import \(?([^)#]*?)\)?$|import (opspace[.\w]*))", re.M | re.S
)


def sources() -> list[Path]:
    """List what compiled code is made of: kernels, whatever they import, and how they are compiled.

    Constants of those files are frozen into the code; nothing else is.
    """
    found: set[Path] = {PACKAGE / "machine" / "jit.py", PACKAGE / "machine" / "record.py"}
    waiting = sorted((PACKAGE / "kernels").glob("*.py"))
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found.add(path)
        for module, names, plain in IMPORTED.findall(path.read_text(encoding="utf-8")):
            waiting += _files(module or plain, re.findall(r"\w+", names))
    return sorted(found)


def _files(module: str, names: list[str]) -> list[Path]:
    """Files that an import takes names from: those that are modules themselves, or else the module's."""
    place = PACKAGE.joinpath(*module.split(".")[1:])
    parts = [place / f"{name}.py" for name in names]
    if parts and all(path.is_file() for path in parts):
        return parts
    return [path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file()]


def stamp() -> str:
    """Contents of everything that is compiled; times say nothing about them."""
    contents = hashlib.sha256()
    for path in sources():
        contents.update(path.read_bytes())
    return contents.hexdigest()


STAMP = stamp()


def jit(function: Callable[..., Any], *, counted: bool = False, nogil: bool = False) -> Any:
    """Compile a function at first use and keep it on disk; a division by zero gives inf or nan.

    What is kept counts as old when any compiled source has changed: by itself numba looks at the
    file of the function alone, not at those of the functions that it calls.

    Args:
        function: The function.
        counted: Whether it makes arrays; no compiled function may then call it.
        nogil: Whether other threads of Python may run while it does.
    """
    compiled = compile_and_keep(
        function,
        stamp=STAMP,
        generation=GENERATION,
        nogil=nogil,
        error_model="numpy",
        fastmath=FAST,
        **({} if counted else UNCOUNTED),
    )
    # A literal among the arguments would compile everything below once more.
    template = compiled.get_call_template
    compiled.get_call_template = lambda args, kws: template(*_unliteral(args, kws))
    return compiled


def _unliteral(args: Any, kws: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    return tuple(map(types.unliteral, args)), {k: types.unliteral(kind) for k, kind in kws.items()}
