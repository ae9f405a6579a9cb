"""Compile kernels into objects with a C interface, each optimised once as a whole."""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import importlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
from llvmlite import binding as llvm
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core import config as settings
from numba.core.compiler_lock import global_compiler_lock

from opspace.machine.field_table import RecordTable
from opspace.machine.freeze import MEMORY, Frozen, freeze
from opspace.machine.handle_type import array_at, array_type, handle_type
from opspace.machine.kernel_entry import Argument, KernelEntry, stamp_of
from opspace.machine.processor import Processor

LIBRARY = {
    *("acos", "asin", "atan", "atan2", "cos", "cosh", "exp", "fmod", "log", "pow", "sin"),
    *("sincos", "sqrt", "tan", "tanh", "memcpy", "memmove", "memset"),
    *("clock_gettime", "nanosleep"),
}
"""What the object may ask of the process that loads it: C's own library, nothing of Python's."""

STAMP = "opspace_stamp"
"""Symbol of the text that says what the object was made of; who links it compares."""

VECTOR = array_type(np.dtype(float), 1)
TYPES: dict[Any, Any] = {float: types.float64, int: types.int64, np.ndarray: VECTOR}


def compile_objects(
    entries: Sequence[KernelEntry],
    processors: Sequence[Processor],
    frozen: Frozen | None = None,
) -> list[bytes]:
    """Compile entries and everything that they call.

    Numba only translates. LLVM optimises once, when all is in one piece: done function by function,
    as numba does by itself, every caller optimises and emits its callees again, which takes three
    times as long and gives slower code.

    Args:
        entries: The functions.
        processors: What for; none of them need be the one that this is run on.
        frozen: Records that the entries it names are compiled for alone; None is any.

    Returns:
        The object file for each.

    Raises:
        ImportError: A kernel asks for something that is neither here nor in C's library.
    """
    stamp = stamp_of(entries)
    if frozen is not None:
        entries = [entry for entry in entries if entry.name in frozen.names]
        stamp = f"{stamp}-{frozen.stamp}"
    with _translated_only(), global_compiler_lock:
        text = _translation(entries, stamp)
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return [_compiled(text, entries, processor, frozen) for processor in processors]


def _compiled(
    text: str,
    entries: Sequence[KernelEntry],
    processor: Processor,
    frozen: Frozen | None,
) -> bytes:
    module = llvm.parse_assembly(text)
    if frozen is not None:
        freeze(module, entries, frozen)
    machine = processor.machine()
    module.triple, module.data_layout = processor.triple, str(machine.target_data)
    seen = {STAMP, MEMORY, *(entry.symbol for entry in entries)}
    parts = [*module.functions, *module.global_variables]
    for number, part in enumerate(parts):
        if not part.is_declaration and part.name not in seen:
            part.linkage = "internal"
            part.name = f"part{number}"  # numba's names hold numbers that another run has not
    _optimise(module, machine, vectorise=frozen is None or frozen.vectorise)
    asked = {f.name for f in module.functions if f.is_declaration}
    if foreign := {name for name in asked if not name.startswith("llvm.")} - LIBRARY:
        raise ImportError(f"compiled kernels ask for {', '.join(sorted(foreign))}")
    return machine.emit_object(module)


@contextmanager
def _translated_only() -> Iterator[None]:
    """Have numba optimise nothing."""
    config: Any = settings
    before = config.OPT
    config.OPT = type(before)(0)
    try:
        yield
    finally:
        config.OPT = before


def _translation(entries: Sequence[KernelEntry], stamp: str) -> str:
    """Return LLVM's form of the entries and of everything that they call, as text."""
    kernels: list[Any] = [getattr(importlib.import_module(e.module), e.name) for e in entries]
    context = kernels[0].targetctx
    library = context.codegen().create_library("opspace")
    module = library.create_ir_module("opspace")
    for entry, kernel in zip(entries, kernels, strict=True):
        signature = tuple(map(_type_of, entry.takes))
        kernel.compile(signature)
        compiled = kernel.overloads[signature]
        library.add_linking_library(compiled.library)
        _define(entry, compiled.fndesc, context, module)
    said = cgutils.make_bytearray(stamp.encode() + bytes(1))
    cgutils.global_constant(module, STAMP, said, linkage="")
    library.add_ir_module(module)
    library.finalize()
    return library.get_llvm_str()


def _type_of(argument: Argument) -> Any:
    return handle_type(argument) if isinstance(argument, RecordTable) else TYPES[argument]


def _define(entry: KernelEntry, found: Any, context: Any, module: Any) -> None:
    """Add the C function; the code for an exception is dropped, since kernels raise none."""
    address, size = cgutils.voidptr_t, cgutils.intp_t
    given: list[Any] = []
    for kind in found.argtypes:
        given += [address, size] if kind is VECTOR else [context.get_value_type(kind)]
    back = ir.VoidType() if entry.gives is None else context.get_value_type(found.restype)
    function = ir.Function(module, ir.FunctionType(back, given), entry.symbol)
    builder = ir.IRBuilder(function.append_basic_block())
    kernel = context.declare_function(module, found)
    left = iter(function.args)
    arguments = [
        array_at(context, builder, VECTOR, next(left), [next(left)])
        if kind is VECTOR
        else next(left)
        for kind in found.argtypes
    ]
    _, result = context.call_conv.call_function(
        builder, kernel, found.restype, found.argtypes, arguments
    )
    if entry.gives is None:
        builder.ret_void()
    else:
        builder.ret(result)


def _optimise(module: Any, machine: Any, *, vectorise: bool) -> None:
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.loop_vectorization = vectorise
    options.loop_interleaving = False  # rows are too short for two vectors at once
    options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    passes = builder.getModulePassManager()
    passes.run(module, builder)
