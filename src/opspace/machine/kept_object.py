"""Compiled kernels on the disk: those that came with the package, those kept for the next start."""

from __future__ import annotations

import hashlib
import logging
import os
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from opspace.machine.sources import PACKAGE

log = logging.getLogger("opspace")

SUM = hashlib.sha256().digest_size
MOST = 8
"""Objects that are kept of one processor: of branches that are switched between, or of versions."""


def places() -> list[Path]:
    """Directories that may hold what is kept, in the order in which they are looked at.

    They are numba's own, so that one setting moves everything that is compiled: what
    ``NUMBA_CACHE_DIR`` names, or else beside the source, or else the user's cache.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return [Path(chosen)]
    found = [PACKAGE / "kernels" / "__pycache__"]
    with suppress(RuntimeError):  # a user without a home
        found.append(_user_cache() / "opspace")
    return found


def _user_cache() -> Path:
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def read(name: str) -> bytes | None:
    """Return an object that is kept, None if there is none or it is damaged."""
    return next(filter(None, (_whole(place / name) for place in places())), None)


def read_shipped(name: str) -> bytes | None:
    """Return an object that came with the package, None if none did or it is damaged."""
    return _whole(PACKAGE / "machine" / "objects" / name)


def sealed(content: bytes) -> bytes:
    """Return an object with the checksum that a reader expects before it."""
    return hashlib.sha256(content).digest() + content


def _whole(path: Path) -> bytes | None:
    try:
        found = path.read_bytes()
    except OSError:
        return None
    if found == sealed(found[SUM:]):
        return found[SUM:]
    log.debug("%s is damaged", path)
    return None


def writable() -> Path | None:
    """Return the first place that this user may write to."""
    for place in places():
        try:
            place.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place):
                return place
        except OSError:
            continue
    return None


def keep(name: str, content: bytes) -> bool:
    """Keep an object; whoever reads at the same time finds all of it or nothing.

    Returns:
        Whether it is kept: a disk may be full.
    """
    place = writable()
    if place is None:
        return False
    try:
        descriptor, path = tempfile.mkstemp(dir=place)
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(sealed(content))
            os.chmod(path, 0o644)  # others may start from it
            os.replace(path, place / name)
        except OSError:
            os.unlink(path)
            raise
    except OSError as error:
        log.debug("compiled code is not kept: %s", error)
        return False
    _drop_old(place, name)
    return True


def _drop_old(place: Path, name: str) -> None:
    """Remove the oldest objects of the same processor."""
    same = f"{name.rpartition('-')[0]}-*"
    with suppress(OSError):  # somebody else does the same
        for path in sorted(place.glob(same), key=lambda path: -path.stat().st_mtime)[MOST:]:
            path.unlink()
