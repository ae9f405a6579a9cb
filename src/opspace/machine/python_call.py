"""Call C functions from Python in a tenth of the time that ctypes takes."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any

from llvmlite import binding as llvm
from llvmlite import ir

from opspace.machine.kernel_entry import KernelEntry
from opspace.machine.processor import Processor

FASTCALL = 0x80
"""Flag of Python's stable interface: arguments come as an array with their number."""

_WORD, _DOUBLE = ir.IntType(64), ir.DoubleType()
_ADDRESS = ir.IntType(8).as_pointer()
_READ = {float: ("PyFloat_AsDouble", _DOUBLE), int: ("PyLong_AsLongLong", _WORD)}


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
    read = [_READ.get(one, ("PyLong_AsLongLong", _WORD)) for one in entry.takes]
    kernel = ir.FunctionType(_WORD if entry.gives else ir.VoidType(), [kind for _, kind in read])
    call = ir.FunctionType(_ADDRESS, (_ADDRESS, _ADDRESS.as_pointer(), _WORD))
    function = ir.Function(module, call, entry.symbol)
    builder = ir.IRBuilder(function.append_basic_block())
    given = []
    for i, (name, kind) in enumerate(read):
        one = builder.load(builder.gep(function.args[1], [_WORD(i)]))
        given.append(builder.call(_of_python(module, name, kind, _ADDRESS), [one]))
    found = builder.call(builder.inttoptr(_WORD(address), kernel.as_pointer()), given)
    back = _of_python(module, "PyLong_FromLongLong", _ADDRESS, _WORD)
    builder.ret(builder.call(back, [found if entry.gives else _WORD(0)]))


def _of_python(module: ir.Module, name: str, gives: ir.Type, takes: ir.Type) -> Any:
    if name in module.globals:
        return module.get_global(name)
    return ir.Function(module, ir.FunctionType(gives, [takes]), name)
