"""How an element of an array is read and written by code that numba translates for others.

Numba's own way, which knows every layout and every index, has seven times the instructions, and each
of them has to be made, written, read and optimised.
"""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import operator
from typing import Any

from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.cpython import slicing
from numba.np import arrayobj


@lower_builtin(operator.getitem, types.Array, types.Integer)
@lower_builtin(operator.getitem, types.Array, types.BaseTuple)
def _read(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    array, index = signature.args
    if not _is_element(array, index):
        many = isinstance(index, types.BaseTuple)
        other = arrayobj.getitem_array_tuple if many else arrayobj.getitem_arraynd_intp
        return other(context, builder, signature, values)
    place = _address(context, builder, signature, values)
    return arrayobj.load_item(context, builder, array, place)


@lower_builtin(operator.setitem, types.Array, types.Any, types.Any)
def _write(context: Any, builder: Any, signature: Any, values: Any) -> None:
    array, index, kind = signature.args
    if not _is_element(array, index):
        arrayobj.setitem_array(context, builder, signature, values)
        return
    value = context.cast(builder, values[2], kind, array.dtype)
    place = _address(context, builder, signature, values)
    arrayobj.store_item(context, builder, array, value, place)


def _is_element(array: Any, index: Any) -> bool:
    """Tell whether an index names one element of an array without gaps."""
    kinds = _kinds(index)
    whole = all(isinstance(kind, types.Integer) for kind in kinds)
    return array.layout == "C" and len(kinds) == array.ndim and whole


def _kinds(index: Any) -> tuple[Any, ...]:
    return tuple(getattr(index, "types", (index,)))


def _address(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    array, index = signature.args[:2]
    model, value = context.data_model_manager[array], values[0]
    many = isinstance(index, types.BaseTuple)
    given = cgutils.unpack_tuple(builder, values[1], array.ndim) if many else (values[1],)
    extents = cgutils.unpack_tuple(builder, model.get(builder, value, "shape"), array.ndim)
    along = [
        slicing.fix_index(builder, context.cast(builder, i, kind, types.intp), extent)
        for i, kind, extent in zip(given, _kinds(index), extents, strict=True)
    ]
    place = along[0]
    for i, extent in zip(along[1:], extents[1:], strict=True):
        place = builder.add(builder.mul(place, extent), i)
    return builder.gep(model.get(builder, value, "data"), [place])
