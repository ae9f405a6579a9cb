"""How everything here is compiled."""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba import types
from numba.core import typed_passes as typed
from numba.core import untyped_passes as untyped
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager
from numba.core.options import DefaultOptions

from opspace.machine import handle_type  # noqa: F401 - numba learns what a handle is

FAST = {"reassoc", "contract"}
"""Sums may be taken in another order, four at a time; inf and nan stay what they are."""


UNCOUNTED: dict[str, Any] = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
"""Nothing counts references to arrays: on small matrices that takes longer than the mathematics.
Whoever calls keeps the arrays; none is made here."""

PASSES = (
    untyped.TranslateByteCode,
    untyped.FixupArgs,
    untyped.IRProcessing,
    untyped.GenericRewrites,
    untyped.ReconstructSSA,
    typed.NopythonTypeInference,
    typed.PreLowerStripPhis,
    typed.IRLegalization,
    typed.AnnotateTypes,
    typed.NativeLowering,
    typed.NoPythonBackend,
)
"""Those of numba's that numbers, loops and calls need; the other half looks for what kernels have
none of, such as closures, ``with`` and arithmetic of whole arrays."""


class KernelPipeline(CompilerBase):
    """Numba, with `PASSES` alone."""

    def define_pipelines(self) -> list[Any]:
        """Return the one way to compile."""
        passes = PassManager("kernel")
        for one in PASSES:
            passes.add_pass(one, one.__name__)
        passes.finalize()
        return [passes]


def jit(function: Callable[..., Any]) -> Any:
    """Make a function that other compiled ones call; a division by zero gives inf or nan.

    What users run is compiled as a whole, see `opspace.machine.compile_object`.
    """
    compiled: Any = numba.njit(
        error_model="numpy", fastmath=FAST, pipeline_class=KernelPipeline, **UNCOUNTED
    )(function)
    # A literal among the arguments would compile everything below once more.
    template = compiled.get_call_template
    compiled.get_call_template = lambda args, kws: template(*_unliteral(args, kws))
    return compiled


def _unliteral(args: Any, kws: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    return tuple(map(types.unliteral, args)), {k: types.unliteral(kind) for k, kind in kws.items()}
