"""What compiled code is made of, and the stamp that says so."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
COMPILERS = (
    *("jit.py", "handle_type.py", "array_elements.py", "array_vectors.py"),
    *("sine_vectors.py", "vector_code.py", "translate.py", "compile_object.py"),
)
IMPORTED = re.compile(
    r"^(?:from (opspace[.\w]*) import \(?([^)#]*?)\)?$|import (opspace[.\w]*))", re.M | re.S
)


def sources() -> list[Path]:
    """List what compiled code is made of: kernels, whatever they import, and how they are compiled.

    Constants of those files are frozen into the code; nothing else is.
    """
    machine = PACKAGE / "machine"
    found: set[Path] = {machine / name for name in COMPILERS}
    waiting = sorted((PACKAGE / "kernels").glob("*.py"))
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found.add(path)
        if (
            path.parent != machine
        ):  # whatever that imports is how kernels are called, not what they are
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


def stamp(layout: str = "") -> str:
    """Contents of everything that is compiled; times say nothing about them.

    Args:
        layout: What else is frozen into the code: arguments, and where the fields of records are.
    """
    contents = hashlib.sha256(layout.encode())
    for path in sources():
        contents.update(path.read_bytes())
    return contents.hexdigest()
