"""Compiled functions that Python calls: shipped, found on the disk or compiled once, then loaded."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Sequence
from functools import cached_property
from typing import Any

from llvmlite import binding as llvm

from opspace.machine.compile_apart import compile_apart
from opspace.machine.freeze import Frozen
from opspace.machine.kept_object import keep, read, read_shipped, sealed, writable
from opspace.machine.kernel_entry import KernelEntry, stamp_of
from opspace.machine.processor import SHIPPED, Processor, host
from opspace.machine.python_call import PythonCalls

log = logging.getLogger("opspace")

ESTIMATE = "about half a minute, on a busy machine more"
"""How long it takes, measured on a shared core: 24 to 30 s of it."""


class Library:
    """Compiled functions in one object, which every process loads as it is.

    Attributes:
        came: Where the object came from, ``"shipped"``, ``"kept"`` or ``"compiled"``; empty before
            it is loaded.

    Args:
        module: Module that has them as ``ENTRIES``.
        entries: The functions.
    """

    came = ""

    def __init__(self, module: str, entries: Sequence[KernelEntry]) -> None:
        self._module = module
        self._entries = tuple(entries)
        self._functions: dict[str, Any] = {}
        self._engine: Any = None  # its memory holds the code
        self._calls: PythonCalls | None = None
        self._lock = threading.Lock()

    def __getitem__(self, name: str) -> Any:
        """Return a function, to be called with numbers and the addresses of handles."""
        if not self._functions:
            self.load()
        return self._functions[name]

    def load(self) -> float:
        """Load the functions, compiled before or now; immediate when that has happened already.

        Returns:
            How long it took, s.
        """
        if self._functions:
            return 0.0
        start = time.perf_counter()
        with self._lock:
            if not self._functions:
                processor = host()
                self._functions = self._linked(self._found(processor), processor)
        return time.perf_counter() - start

    def file_name(self, processor: Processor) -> str:
        """Return the name under which the object is kept; another one is made of something else."""
        return f"kernels-{processor.name}-{self.stamp}.o"

    def object(self) -> bytes:
        """Return the object for this machine, compiled before or now, for a linker."""
        return self._found(host())

    def object_for(self, frozen: Frozen) -> bytes:
        """Compile some of the functions for some records alone, for a linker on this machine."""
        (made,) = self._made((host(),), frozen)
        return made

    def to_ship(self) -> dict[str, bytes]:
        """Compile for every processor of `SHIPPED`.

        Returns:
            Contents by name of the files that belong into ``opspace/machine/objects``.
        """
        made = self._made(SHIPPED)
        return {self._shipped(p): sealed(one) for p, one in zip(SHIPPED, made, strict=True)}

    @cached_property
    def stamp(self) -> str:
        """What the object says of itself, and whoever relies on it must have been made for."""
        return stamp_of(self._entries)

    def _shipped(self, processor: Processor) -> str:
        return f"kernels-{processor.kind}-{self.stamp}.o"

    def _found(self, processor: Processor) -> bytes:
        if found := read_shipped(self._shipped(processor)):
            self.came = "shipped"
            return found
        name = self.file_name(processor)
        if found := read(name):
            self.came = "kept"
            return found
        self.came = "compiled"
        return self._compiled(name, processor)

    def _compiled(self, name: str, processor: Processor) -> bytes:
        """Compile, keep that and say so; what somebody else has kept in the meantime goes first."""
        start = time.perf_counter()
        if writable():
            log.warning("compiling the control tick, once after each installation: %s", ESTIMATE)
        else:
            log.warning(
                "compiling the control tick, as every start will: no directory for it can be "
                "written, and NUMBA_CACHE_DIR may name one; %s",
                ESTIMATE,
            )
        (made,) = self._made((processor,))
        found = read(name)
        after = "; it is kept for the next start" if found or keep(name, made) else ""
        log.warning("compiled the control tick in %.0f s%s", time.perf_counter() - start, after)
        return found or made

    def _made(self, processors: Sequence[Processor], frozen: Frozen | None = None) -> list[bytes]:
        made = compile_apart(self._module, processors, frozen)
        if made is None:
            from opspace.machine.compile_object import compile_objects  # noqa: PLC0415 - only now

            made = compile_objects(self._entries, processors, frozen)
        return made

    def _linked(self, content: bytes, processor: Processor) -> dict[str, Any]:
        engine = self._engine = llvm.create_mcjit_compiler(
            llvm.parse_assembly(""), processor.machine()
        )
        engine.add_object_file(llvm.ObjectFileRef.from_data(content))
        engine.finalize_object()
        found = {entry: engine.get_function_address(entry.symbol) for entry in self._entries}
        freely = {
            entry.name: entry.free_call(found.pop(entry))
            for entry in self._entries
            if entry.releases
        }
        self._calls = PythonCalls(found, processor)
        return freely | self._calls.functions
