"""Call C functions from Python in a tenth of the time that ctypes takes."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any

from llvmlite import binding as llvm
from llvmlite import ir

from opspace.machine.answer_call import DOUBLE, OBJECT, WORD, AnswerParts, Python, define_answer
from opspace.machine.kernel_entry import KernelEntry
from opspace.machine.processor import Processor

FASTCALL = 0x80
"""Flag of Python's stable interface: arguments come as an array with their number."""

_READ = {float: ("PyFloat_AsDouble", DOUBLE), int: ("PyLong_AsLongLong", WORD)}


class _Method(ctypes.Structure):
    """Python's description of a function written in C."""

    _fields_ = (
        ("name", ctypes.c_char_p),
        ("function", ctypes.c_void_p),
        ("flags", ctypes.c_int),
        ("doc", ctypes.c_char_p),
    )


class PythonCalls:
    """Functions of Python that call C functions, with the interpreter held.

    Nothing is checked: numbers and addresses must be what they are said to be.

    Args:
        entries: The C functions, and where each is.
        processor: What this is run on.
    """

    def __init__(self, entries: Mapping[KernelEntry, int], processor: Processor) -> None:
        module = ir.Module()
        for entry, address in entries.items():
            if entry.gives is AnswerParts:
                define_answer(module, entry.symbol, address)
            else:
                _define(module, entry, address)
        # What was made lives as long as this does, and whoever calls keeps this.
        self._engine = llvm.create_mcjit_compiler(
            llvm.parse_assembly(str(module)), processor.machine()
        )
        self._engine.finalize_object()
        self._methods = [
            _Method(e.name.encode(), self._engine.get_function_address(e.symbol), FASTCALL, None)
            for e in entries
        ]
        make = ctypes.pythonapi.PyCFunction_NewEx
        make.restype, make.argtypes = ctypes.py_object, (ctypes.c_void_p,) * 3
        self.functions: dict[str, Any] = {
            entry.name: make(ctypes.addressof(method), None, None)
            for entry, method in zip(entries, self._methods, strict=True)
        }


def _define(module: ir.Module, entry: KernelEntry, address: int) -> None:
    """Write the function: read the arguments, call, make what it returns an int."""
    read = [_READ.get(one, _READ[int]) for one in entry.takes]
    kernel = ir.FunctionType(WORD if entry.gives else ir.VoidType(), [kind for _, kind in read])
    call = ir.FunctionType(OBJECT, (OBJECT, OBJECT.as_pointer(), WORD))
    builder = ir.IRBuilder(ir.Function(module, call, entry.symbol).append_basic_block())
    python, arguments = Python(builder), builder.function.args[1]
    given = [
        python(name, kind, python.argument(arguments, i)) for i, (name, kind) in enumerate(read)
    ]
    found = builder.call(builder.inttoptr(WORD(address), kernel.as_pointer()), given)
    builder.ret(python("PyLong_FromLongLong", OBJECT, found if entry.gives else WORD(0)))
