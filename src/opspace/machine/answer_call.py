"""A kernel as a function of Python that takes arrays as they are and makes the whole answer itself."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import numpy as np
from llvmlite import ir

WORD, INT, DOUBLE, BYTE = ir.IntType(64), ir.IntType(32), ir.DoubleType(), ir.IntType(8)
OBJECT = BYTE.as_pointer()
NOTHING = ir.VoidType()

REFERENCES, TYPE = 0, 8
DATA, NDIM, SHAPE, STRIDES, DTYPE, FLAGS = 16, 24, 32, 40, 56, 64
"""Where objects of Python have their number of references and their type, and arrays of NumPy what
compiled extensions read of them."""

SPARE = 4
"""Arrays that are kept to answer with; one that nobody else has any more is used again."""

BARE_TUPLE = 24
"""Size of an empty tuple; one that also keeps its hash would have to be told that it has none yet."""


def layout_is_known() -> bool:
    """Tell whether objects of this interpreter, and its arrays, lie as they are read here."""
    array = np.arange(6.0).reshape(2, 3)
    words = (ctypes.c_int64 * 8).from_address(id(array))
    shape, strides = ((ctypes.c_int64 * 2).from_address(words[i // 8]) for i in (SHAPE, STRIDES))
    found = words[TYPE // 8], words[DATA // 8], words[DTYPE // 8], words[NDIM // 8] & 0xFFFFFFFF
    known = id(np.ndarray), array.ctypes.data, id(array.dtype), array.ndim
    number = ctypes.c_int64.from_address(id(0.5) + TYPE).value
    same = tuple(shape) == array.shape and tuple(strides) == array.strides
    before = _references(array)
    others = [array, array]
    same = same and _references(array) == before + len(others)
    return same and found == known and number == id(float) and tuple.__basicsize__ == BARE_TUPLE


def _references(thing: object) -> int:
    return ctypes.c_int32.from_address(id(thing) + REFERENCES).value


def flags_of(array: np.ndarray) -> int:
    """Read what NumPy notes of an array: whether it may be written, and so on."""
    return ctypes.c_int32.from_address(id(array) + FLAGS).value


class AnswerParts(ctypes.Structure):
    """What such a function answers with; it is told where this is, and whoever calls keeps it.

    It is None where the kernel gives a number below zero, or an argument is no float, or no contiguous
    array (n,) of float64. Else it is

        kind(t, copy(), names[number % base], number // base, report(made_with, memory, rest))

    where one of the spare arrays stands for the copy, if nobody has it and it is as it was made.

    Attributes:
        base: What divides the number that the kernel gives.
        block: Where the memory begins that the kernel has filled.
        size: How many bytes of it go into the answer.
        copy: Gives the array of the answer.
        spare: Where the addresses of `SPARE` arrays are.
        source: Where the numbers of that array are.
        length: How many.
        flags: What NumPy notes of such an array.
        names: Gives what a remainder stands for.
        usual: What 0 stands for.
        kind: A named tuple.
        report: Another one.
        made_with: Its first member.
        rest: Its last one.
        array: The type of arrays.
        number: The type of floats.
        double: The dtype of float64.
        first: Address of the kernel's first record.
        second: Of its second one.
    """

    _fields_ = (
        ("base", ctypes.c_int64),
        ("block", ctypes.c_void_p),
        ("size", ctypes.c_int64),
        ("copy", ctypes.py_object),
        ("spare", ctypes.c_void_p),
        ("source", ctypes.c_void_p),
        ("length", ctypes.c_int64),
        ("flags", ctypes.c_int32),
        ("names", ctypes.py_object),
        ("usual", ctypes.py_object),
        ("kind", ctypes.py_object),
        ("report", ctypes.py_object),
        ("made_with", ctypes.py_object),
        ("rest", ctypes.py_object),
        ("array", ctypes.py_object),
        ("number", ctypes.py_object),
        ("double", ctypes.py_object),
        ("first", ctypes.c_void_p),
        ("second", ctypes.c_void_p),
    )


class Python:
    """Calls of Python's stable interface, written into a function.

    Args:
        builder: What writes it.
    """

    def __init__(self, builder: ir.IRBuilder) -> None:
        self.builder = builder

    def __call__(self, name: str, gives: ir.Type, *given: Any) -> Any:
        """Call one of its functions."""
        known = self.builder.module.globals
        if name not in known:
            ir.Function(
                self.builder.module, ir.FunctionType(gives, [one.type for one in given]), name
            )
        return self.builder.call(known[name], given)

    def argument(self, arguments: Any, i: int) -> Any:
        """Return one of the arguments of a function."""
        return self.builder.load(self.builder.gep(arguments, [WORD(i)]))

    def tuple_of(self, kind: Any, members: Sequence[Any]) -> Any:
        """Make a named tuple, which keeps its members; let all go where one has not been made."""
        builder = self.builder
        made = self("PyType_GenericAlloc", OBJECT, kind, WORD(len(members)))
        there = reduce(
            builder.and_,
            (builder.icmp_unsigned("!=", one, OBJECT(None)) for one in (made, *members)),
        )
        result = builder.alloca(OBJECT)
        with builder.if_else(there) as (whole, broken):
            with whole:
                for i, member in enumerate(members):
                    self("PyTuple_SetItem", INT, made, WORD(i), member)
                builder.store(made, result)
            with broken:
                for one in (made, *members):
                    self("Py_DecRef", NOTHING, one)
                builder.store(OBJECT(None), result)
        return builder.load(result)


def define_answer(module: ir.Module, symbol: str, kernel: int) -> None:
    """Write the function, of a float, two arrays, and where its `AnswerParts` is.

    Args:
        module: Where it goes.
        symbol: Its name there.
        kernel: Address of a function in C of the float, address and size of both arrays, and the
            addresses of two records; it gives a whole number.
    """
    call = ir.FunctionType(OBJECT, (OBJECT, OBJECT.as_pointer(), WORD))
    builder = ir.IRBuilder(ir.Function(module, call, symbol).append_basic_block())
    python = Python(builder)
    time, q, v, where = (python.argument(builder.function.args[1], i) for i in range(4))
    answer = builder.inttoptr(python("PyLong_AsLongLong", WORD, where), OBJECT)

    def own(name: str, kind: ir.Type = OBJECT) -> Any:
        return _member(builder, answer, getattr(AnswerParts, name).offset, kind)

    kinds = (time, own("number")), (q, own("array")), (v, own("array"))
    _go_on_where(builder, [_same(builder, _member(builder, x, TYPE), kind) for x, kind in kinds])
    _go_on_where(builder, [fit for x in (q, v) for fit in _row(builder, x, own("double"))])
    t = python("PyFloat_AsDouble", DOUBLE, time)
    arrays = [part for x in (q, v) for part in _memory(builder, x)]
    given = [t, *arrays, own("first"), own("second")]
    kind = ir.FunctionType(WORD, [one.type for one in given])
    number = builder.call(builder.inttoptr(WORD(kernel), kind.as_pointer()), given)
    _go_on_where(builder, [builder.icmp_signed(">=", number, WORD(0))])
    made_with, rest, base = own("made_with"), own("rest"), own("base", WORD)
    python("Py_IncRef", NOTHING, made_with)
    python("Py_IncRef", NOTHING, rest)
    python("Py_IncRef", NOTHING, time)
    memory = python("PyBytes_FromStringAndSize", OBJECT, own("block"), own("size", WORD))
    name = _name(python, own("names"), own("usual"), builder.srem(number, base))
    members = (
        time,
        _array(python, own),
        name,
        python("PyLong_FromLongLong", OBJECT, builder.sdiv(number, base)),
        python.tuple_of(own("report"), (made_with, memory, rest)),
    )
    builder.ret(python.tuple_of(own("kind"), members))


def _name(python: Python, names: Any, usual: Any, number: Any) -> Any:
    """Look up what a number stands for."""
    builder = python.builder
    result = builder.alloca(OBJECT)
    with builder.if_else(_same(builder, number, WORD(0)), likely=True) as (zero, other):
        with zero:
            python("Py_IncRef", NOTHING, usual)
            builder.store(usual, result)
        with other:
            key = python("PyLong_FromLongLong", OBJECT, number)
            builder.store(python("PyObject_GetItem", OBJECT, names, key), result)
            python("Py_DecRef", NOTHING, key)
    return builder.load(result)


def _array(python: Python, own: Callable[..., Any]) -> Any:
    """Take a spare array and fill it, or make one."""
    builder = python.builder
    spare, double, length = own("spare"), own("double"), own("length", WORD)
    found, made = (builder.append_basic_block(name) for name in ("found", "made"))
    taken: list[tuple[Any, Any]] = []
    for i in range(SPARE):
        array = _member(builder, spare, 8 * i)
        another = builder.append_basic_block("another")
        _branch(builder, _nobody_has(builder, array), another)
        _branch(builder, _as_made(builder, array, double, length, own("flags", INT)), another)
        taken.append((array, builder.block))
        builder.branch(found)
        builder.position_at_end(another)
    copy = python("PyObject_CallNoArgs", OBJECT, own("copy"))
    last = builder.block
    builder.branch(made)
    builder.position_at_end(found)
    array = builder.phi(OBJECT)
    for one, block in taken:
        array.add_incoming(one, block)
    python("Py_IncRef", NOTHING, array)
    size = builder.mul(length, WORD(8))
    python("memcpy", OBJECT, _member(builder, array, DATA), own("source"), size)
    builder.branch(made)
    builder.position_at_end(made)
    result = builder.phi(OBJECT)
    result.add_incoming(copy, last)
    result.add_incoming(array, found)
    return result


def _nobody_has(builder: ir.IRBuilder, array: Any) -> list[Any]:
    one_axis = _same(builder, _member(builder, array, NDIM, INT), INT(1))
    return [_same(builder, _member(builder, array, REFERENCES, INT), INT(1)), one_axis]


def _as_made(builder: ir.IRBuilder, array: Any, double: Any, length: Any, flags: Any) -> list[Any]:
    size, step = (_member(builder, _member(builder, array, i), 0, WORD) for i in (SHAPE, STRIDES))
    return [
        _same(builder, size, length),
        _same(builder, step, WORD(8)),
        _same(builder, _member(builder, array, DTYPE), double),
        _same(builder, _member(builder, array, FLAGS, INT), flags),
    ]


def _branch(builder: ir.IRBuilder, all_hold: Sequence[Any], otherwise: Any) -> None:
    """Go on where all hold."""
    there = builder.append_basic_block("there")
    builder.cbranch(reduce(builder.and_, all_hold), there, otherwise)
    builder.position_at_end(there)


def _member(builder: ir.IRBuilder, whole: Any, offset: int, kind: ir.Type = OBJECT) -> Any:
    """Read a member of a structure."""
    place = builder.gep(whole, [WORD(offset)])
    return builder.load(builder.bitcast(place, kind.as_pointer()))


def _same(builder: ir.IRBuilder, one: Any, other: Any) -> Any:
    return builder.icmp_unsigned("==", one, other)


def _row(builder: ir.IRBuilder, array: Any, double: Any) -> tuple[Any, Any]:
    """Tell whether an array has one axis and the dtype of float64."""
    axes = _member(builder, array, NDIM, INT)
    return _same(builder, axes, INT(1)), _same(builder, _member(builder, array, DTYPE), double)


def _memory(builder: ir.IRBuilder, array: Any) -> tuple[Any, Any]:
    """Return address and size of such an array; no size where there is something between its words."""
    size, step = (_member(builder, _member(builder, array, i), 0, WORD) for i in (SHAPE, STRIDES))
    address = _member(builder, array, DATA, WORD)
    whole = builder.and_(
        _same(builder, step, WORD(8)), _same(builder, builder.and_(address, WORD(7)), WORD(0))
    )
    return builder.inttoptr(address, OBJECT), builder.select(whole, size, WORD(0))


def _go_on_where(builder: ir.IRBuilder, all_hold: Sequence[Any]) -> None:
    """Give None back where something does not hold."""
    whole = reduce(builder.and_, all_hold)
    with builder.if_then(builder.not_(whole), likely=False):
        none = builder.module.globals.get("_Py_NoneStruct") or ir.GlobalVariable(
            builder.module, BYTE, "_Py_NoneStruct"
        )
        Python(builder)("Py_IncRef", NOTHING, none)
        builder.ret(none)
