"""How compiled functions get their memory: a record of arrays as one argument.

Passing an array to a compiled function costs some 0.05 µs, and each use of one that belongs to
Python counts a reference, which costs as much as the mathematics on a small matrix. A handle is an
address: arrays are read from it where they are used, and are never counted. Whoever made it keeps them.
"""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import (
    NativeValue,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np.arrayobj import make_array, populate_array
from numba.np.numpy_support import from_dtype

WORD = 8
WORDS = (np.dtype(np.float64), np.dtype(np.int64))


class HandleType(types.Type):
    """Type of a handle: names and types of its fields, and where each begins.

    Args:
        kind: Name of the record.
        fields: Names with types, which are arrays or handles.
    """

    def __init__(self, kind: str, fields: tuple[tuple[str, Any], ...]) -> None:
        self.kind = kind
        self.fields = dict(fields)
        self.start: dict[str, int] = {}
        words = 0
        for name, field in fields:
            self.start[name] = words
            words += 1 if isinstance(field, HandleType) else 1 + field.ndim
        super().__init__(f"{kind}({''.join(map(_letter, self.fields.values()))})")


def _letter(field: Any) -> str:
    """Shortest name of a field's type; names of compiled functions are made of it."""
    return "h" if isinstance(field, HandleType) else f"{str(field.dtype)[0]}{field.ndim}"


class Handle:
    """A record of arrays, for compiled functions only.

    Args:
        kind: Name of the record.
        fields: Arrays, contiguous and writable, and other handles.
    """

    __slots__ = ("_fields", "_kind", "_type", "_words", "address")

    def __init__(self, kind: str, fields: Mapping[str, np.ndarray | Handle]) -> None:
        self._kind = kind
        self._fields = dict(fields)
        self._type: HandleType | None = None
        words: list[int] = []
        for name, field in fields.items():
            if isinstance(field, Handle):
                words.append(field.address)
                continue
            if not field.flags.carray or field.dtype not in WORDS:
                raise ValueError(
                    f"{kind}.{name} must be contiguous, aligned, writable and of words"
                )
            words += [_address(field), *field.shape]
        self._words = np.array(words, np.uintp)
        self.address = _address(self._words)

    @property
    def _numba_type_(self) -> HandleType:
        """The type, for numba: made when it is asked for, which takes longer than all the rest."""
        found = self._type
        if found is None:
            fields = tuple((name, _type_of(field)) for name, field in self._fields.items())
            found = self._type = HandleType(self._kind, fields)
        return found


def _address(array: np.ndarray) -> int:
    """Where an array begins, in a quarter of the time that its own attributes take to tell."""
    buffer: Any = array
    return ctypes.addressof(ctypes.c_char.from_buffer(buffer)) if array.size else 0


def _type_of(field: np.ndarray | Handle) -> Any:
    if isinstance(field, Handle):
        return field._numba_type_
    return _array_type(field.dtype, field.ndim)


@cache
def _array_type(dtype: np.dtype, dimensions: int) -> types.Array:
    return types.Array(from_dtype(dtype), dimensions, "C")


@typeof_impl.register(Handle)
def _typeof_handle(value: Handle, _: object) -> HandleType:
    return value._numba_type_


register_model(HandleType)(models.OpaqueModel)


@infer_getattr
class _HandleAttribute(AttributeTemplate):
    key = HandleType

    def generic_resolve(self, kind: HandleType, name: str) -> Any:
        return kind.fields.get(name)


@lower_getattr_generic(HandleType)
def _field(context: Any, builder: Any, kind: HandleType, value: Any, name: str) -> Any:
    """Read a field: an address and a shape become an array that is not counted."""
    words = builder.bitcast(value, ir.PointerType(cgutils.intp_t))
    first, field = kind.start[name], kind.fields[name]

    def word(i: int) -> Any:
        return builder.load(builder.gep(words, [ir.Constant(cgutils.intp_t, first + i)]))

    if isinstance(field, HandleType):
        return builder.inttoptr(word(0), cgutils.voidptr_t)
    array = make_array(field)(context, builder)
    shape = [word(1 + i) for i in range(field.ndim)]
    itemsize = ir.Constant(cgutils.intp_t, WORD)
    strides = [itemsize]
    for extent in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], extent))
    data = builder.inttoptr(word(0), array.data.type)
    populate_array(array, data, shape, strides, itemsize, meminfo=None)
    return array._getvalue()


@unbox(HandleType)
def _unbox_handle(_: HandleType, value: Any, c: Any) -> NativeValue:
    address = c.pyapi.object_getattr_string(value, "address")
    pointer = c.pyapi.long_as_voidptr(address)
    c.pyapi.decref(address)
    return NativeValue(pointer)
