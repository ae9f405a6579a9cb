"""What the compiler must know of a handle: its type, and how a field of it is read."""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from functools import cache, reduce
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
from numba.np.numpy_support import from_dtype

from opspace.machine.field_table import RecordTable
from opspace.machine.record import WORD, Handle


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


def handle_type(table: RecordTable) -> HandleType:
    """Return the type of the handles of a table's records."""
    fields = (
        (f.name, handle_type(f.of) if f.of else array_type(np.dtype(f.dtype), len(f.shape)))
        for f in table.fields
    )
    return HandleType(table.name, tuple(fields))


@cache
def array_type(dtype: np.dtype, dimensions: int) -> types.Array:
    """Return the type of a contiguous array."""
    return types.Array(from_dtype(dtype), dimensions, "C")


@typeof_impl.register(Handle)
def _typeof_handle(value: Handle, context: object) -> HandleType:
    fields = (
        (name, _typeof_handle(x, context) if isinstance(x, Handle) else array_type(x.dtype, x.ndim))
        for name, x in value.fields.items()
    )
    return HandleType(value.kind, tuple(fields))


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
        found = builder.load(builder.gep(words, [ir.Constant(cgutils.intp_t, first + i)]))
        # A handle is not written while compiled code runs: what was read once need not be read again.
        found.set_metadata("invariant.load", builder.module.add_metadata([]))
        return found

    if isinstance(field, HandleType):
        return builder.inttoptr(word(0), cgutils.voidptr_t)
    address = builder.inttoptr(word(0), cgutils.voidptr_t)
    return array_at(context, builder, field, address, [word(1 + i) for i in range(field.ndim)])


def array_at(context: Any, builder: Any, kind: Any, address: Any, shape: list[Any]) -> Any:
    """Make an array, which is not counted, of an address and a shape."""
    itemsize = ir.Constant(cgutils.intp_t, WORD)
    strides = [itemsize]
    for extent in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], extent))
    model = context.data_model_manager[kind]
    kind_of_array: Any = model.get_value_type()
    array = ir.Constant(kind_of_array, None)
    pointer = kind_of_array.elements[model.get_field_position("data")]
    for name, value in (
        ("nitems", reduce(builder.mul, shape)),
        ("itemsize", itemsize),
        ("data", builder.bitcast(address, pointer)),
        ("shape", cgutils.pack_array(builder, shape)),
        ("strides", cgutils.pack_array(builder, strides)),
    ):
        array = model.set(builder, array, value, name)
    return array


@unbox(HandleType)
def _unbox_handle(_: HandleType, value: Any, c: Any) -> NativeValue:
    address = c.pyapi.object_getattr_string(value, "address")
    pointer = c.pyapi.long_as_voidptr(address)
    c.pyapi.decref(address)
    return NativeValue(pointer)
