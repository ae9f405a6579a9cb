"""Have numba translate, and nothing else: for a process that does not run what it compiles."""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import gc
import re
from typing import Any

from numba.core import cgutils, fastmathpass, types
from numba.core.codegen import CodeLibrary
from numba.core.cpu_options import FastMathOptions
from numba.core.registry import cpu_target
from numba.cpython import slicing

from opspace.machine import array_elements  # noqa: F401 - numba learns how to read an element
from opspace.machine.jit import FAST


class Translation(CodeLibrary):
    """What numba made of one function; all of them lie in one module, as they came.

    By itself numba links every function to all that it calls, optimises the whole and emits it.
    """

    def create_ir_module(self, name: str) -> Any:
        """Return the module that all have in common."""
        codegen: Any = self.codegen
        if not hasattr(codegen, "whole"):
            codegen.whole = codegen._create_empty_module("whole")
        return codegen.whole

    def add_linking_library(self, library: Translation) -> None:
        """Do nothing: it lies in the module."""

    def add_ir_module(self, ir_module: Any) -> None:
        """Do nothing: it is the module."""

    def finalize(self) -> None:
        """Do nothing with it."""
        self._finalized = True

    def get_llvm_str(self) -> str:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return all that was translated, each function once."""
        whole = self.create_ir_module("")
        fastmathpass.rewrite_module(whole, FastMathOptions(FAST))
        return _without_unrolling(cgutils.normalize_ir_text(str(whole)))

    def get_function(self, name: str) -> Any:
        """Refuse: there is no code."""
        raise RuntimeError(f"{name} is translated only: there is no code of it to call")

    def get_asm_str(self) -> None:
        """Refuse: there is no code."""
        raise RuntimeError(f"{self.name} is translated only: there is no code of it to show")


def translate_only() -> None:
    """Have numba translate only, as long as this process lives."""
    gc.disable()  # all that is made is kept to the end: looking for rubbish takes a quarter more
    context: Any = cpu_target.target_context
    context.codegen()._library_class = Translation
    context.create_cpython_wrapper = context.create_cfunc_wrapper = _nothing
    context.post_lowering = _nothing  # it would go through the whole module after each function
    context.get_executable = lambda *args: [].append  # a key of its own for each function
    slicing.fix_index = _as_it_is
    types.functions.BaseFunction.get_call_type = _resolved_once


def _without_unrolling(text: str) -> str:
    """Keep loops over whole vectors as they are: most end after one or two turns."""
    end = re.compile(r'(br i1 [^\n]*label %"after[^\n,]*, label %"vectors[^\n,]*)')
    text = end.sub(rf"\1, !llvm.loop !{LOOP}", text)
    return f"""{text}
!{LOOP} = distinct !{{!{LOOP}, !{LOOP + 1}}}
!{LOOP + 1} = !{{!"llvm.loop.unroll.disable"}}
"""


LOOP = 1_000_000
"""Number of a piece of metadata that numba has none of."""


def _nothing(*args: Any, **options: Any) -> None:
    pass


def _as_it_is(builder: Any, index: Any, size: Any) -> Any:
    """Kernels never count from the end: a negative index would be an error, not the last element."""
    return index


_resolve = types.functions.BaseFunction.get_call_type


def _resolved_once(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """Ask once which overload takes arguments of some types: a plus has dozens."""
    known = vars(self).setdefault("known_calls", {})
    asked = (args, *kws.items())
    if asked not in known:
        known[asked] = _resolve(self, context, args, kws)
    return known[asked]
