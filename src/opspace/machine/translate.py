"""Have numba translate, and nothing else: for a process that does not run what it compiles."""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from typing import Any

from llvmlite import binding as llvm
from numba.core import cgutils
from numba.core.codegen import CodeLibrary
from numba.core.registry import cpu_target
from numba.cpython import slicing


class Translation(CodeLibrary):
    """What numba made of one function, and of those that it calls, left as it is.

    By itself numba links every function to all that it calls, optimises the whole and emits it.
    """

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self._parts: list[str] = []
        self._others: list[Translation] = []

    def add_linking_library(self, library: Translation) -> None:
        """Remember a function that is called."""
        self._others.append(library)

    def add_ir_module(self, ir_module: Any) -> None:
        """Take what was translated."""
        self._parts.append(cgutils.normalize_ir_text(str(ir_module)))

    def finalize(self) -> None:
        """Do nothing with it."""
        self._finalized = True

    def get_llvm_str(self) -> str:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the function with all that it calls, each once."""
        whole = llvm.parse_assembly("")
        found: set[Translation] = {self}
        waiting: list[Translation] = [self]
        while waiting:
            one = waiting.pop()
            for part in one._parts:
                whole.link_in(llvm.parse_assembly(part))
            new = [other for other in dict.fromkeys(one._others) if other not in found]
            found.update(new)
            waiting += new
        return str(whole)

    def get_function(self, name: str) -> Any:
        """Refuse: there is no code."""
        raise RuntimeError(f"{name} is translated only: there is no code of it to call")

    def get_asm_str(self) -> None:
        """Refuse: there is no code."""
        raise RuntimeError(f"{self.name} is translated only: there is no code of it to show")


def translate_only() -> None:
    """Have numba translate only, as long as this process lives."""
    context: Any = cpu_target.target_context
    context.codegen()._library_class = Translation
    context.create_cpython_wrapper = context.create_cfunc_wrapper = _nothing
    context.get_executable = lambda *args: [].append  # a key of its own for each function
    slicing.fix_index = _as_it_is


def _nothing(*args: Any, **options: Any) -> None:
    pass


def _as_it_is(builder: Any, index: Any, size: Any) -> Any:
    """Kernels never count from the end: a negative index would be an error, not the last element."""
    return index
