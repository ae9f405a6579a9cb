"""Pieces of translated code that work on a vector of numbers."""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba.core import cgutils

from opspace.machine.lanes import LANES

DOUBLE, INDEX, LANE = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
VECTOR = ir.VectorType(DOUBLE, LANES)
MASK = ir.VectorType(ir.IntType(1), LANES)


def loop(
    builder: Any, first: Any, end: Any, step: int, body: Callable[..., list[Any]],
    start: Sequence[Any] = (),
) -> list[Any]:  # fmt: skip
    """Emit a loop from first to end, and return what it hands on.

    By the names of its blocks `opspace.machine.translate` finds it, so that it is not unrolled.
    """
    before = builder.block
    turn, after = builder.append_basic_block("vectors"), builder.append_basic_block("after")
    builder.cbranch(builder.icmp_signed("<", first, end), turn, after)
    builder.position_at_end(turn)
    k = builder.phi(INDEX)
    k.add_incoming(first, before)
    handed = [builder.phi(value.type) for value in start]
    for phi, value in zip(handed, start, strict=True):
        phi.add_incoming(value, before)
    results = body(k, *handed)
    following, last = builder.add(k, INDEX(step), flags=["nsw"]), builder.block
    for phi, value in zip([k, *handed], [following, *results], strict=True):
        phi.add_incoming(value, last)
    builder.cbranch(builder.icmp_signed(">=", following, end), after, turn)
    builder.position_at_end(after)
    found = [builder.phi(value.type) for value in start]
    for phi, value, result in zip(found, start, results, strict=True):
        phi.add_incoming(value, before)
        phi.add_incoming(result, last)
    return found


def load(builder: Any, array: Any, k: Any) -> Any:
    """Emit a vector of the numbers from k on."""
    place = builder.bitcast(builder.gep(array, [k]), VECTOR.as_pointer())
    return builder.load(place, align=8)


def store(builder: Any, value: Any, array: Any, k: Any) -> None:
    """Emit that a vector is written to the numbers from k on."""
    place = builder.bitcast(builder.gep(array, [k]), value.type.as_pointer())
    builder.store(value, place, align=8)


def load_first(builder: Any, array: Any, k: Any, count: Any) -> Any:
    """Emit a vector of so many numbers from k on, zeros behind; no more is read."""
    kind = ir.FunctionType(VECTOR, [VECTOR.as_pointer(), LANE, MASK, VECTOR])
    name = f"llvm.masked.load.v{LANES}f64.p0v{LANES}f64"
    function = cgutils.get_or_insert_function(builder.module, kind, name)
    place = builder.bitcast(builder.gep(array, [k]), VECTOR.as_pointer())
    there = compared(builder, LANES, "<", count)
    return builder.call(function, [place, LANE(8), there, zeros(VECTOR)])


def store_first(builder: Any, value: Any, array: Any, k: Any, count: Any) -> None:
    """Emit that so many numbers of a vector are written from k on, and no more."""
    kind = ir.FunctionType(ir.VoidType(), [VECTOR, VECTOR.as_pointer(), LANE, MASK])
    name = f"llvm.masked.store.v{LANES}f64.p0v{LANES}f64"
    function = cgutils.get_or_insert_function(builder.module, kind, name)
    place = builder.bitcast(builder.gep(array, [k]), VECTOR.as_pointer())
    builder.call(function, [value, place, LANE(8), compared(builder, LANES, "<", count)])


def compared(builder: Any, lanes: int, which: str, count: Any) -> Any:
    """Emit which places of a vector compare so with a count."""
    places = ir.Constant(ir.VectorType(INDEX, lanes), [INDEX(i) for i in range(lanes)])
    return builder.icmp_signed(which, places, spread(builder, count, lanes))


def kept(builder: Any, x: Any, which: str, count: Any) -> Any:
    """Replace numbers by zero but those whose place compares so with a count."""
    keep = compared(builder, x.type.count, which, count)
    return builder.select(keep, x, zeros(x.type))


def each(builder: Any, function: str, x: Any) -> Any:
    """Emit a function that LLVM knows, of each number of a vector."""
    kind = ir.FunctionType(VECTOR, [VECTOR])
    known = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{function}.v{LANES}f64")
    return builder.call(known, [x])


def multiply_add(builder: Any, x: Any, y: Any, total: Any) -> Any:
    """Emit total + x y."""
    return builder.fadd(total, builder.fmul(x, y))


def zeros(kind: Any) -> Any:
    """Give a vector of zeros."""
    return ir.Constant(kind, [0.0] * kind.count)


def spread(builder: Any, value: Any, lanes: int = LANES) -> Any:
    """Emit a vector of one number everywhere."""
    kind = ir.VectorType(value.type, lanes)
    nothing = ir.Constant(kind, ir.Undefined)
    one = builder.insert_element(nothing, value, LANE(0))
    return builder.shuffle_vector(one, nothing, lanes_of([0] * lanes))


def lanes_of(numbers: Sequence[int]) -> Any:
    """Give places of numbers in vectors."""
    return ir.Constant(ir.VectorType(LANE, len(numbers)), list(numbers))
