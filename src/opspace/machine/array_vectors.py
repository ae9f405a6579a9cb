"""How loops over whole vectors of numbers are translated: without a first or a last few by one.

A loop over three to nine numbers that the compiler makes vectors of spends most of its instructions on
finding out how many there are, whether arrays overlap, and on those that are left over.
"""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from opspace.machine.lanes import LANES
from opspace.machine.vector_code import (
    DOUBLE,
    INDEX,
    LANE,
    VECTOR,
    compared,
    each,
    kept,
    lanes_of,
    load,
    load_first,
    loop,
    multiply_add,
    spread,
    store,
    store_first,
    zeros,
)

FOUR = 4

Emit = Callable[..., Any]


def in_vectors(emit: Emit, returns: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Have calls of a function translated by ``emit``, which takes a builder and what is given.

    Of an array that is its address, of one with two dimensions also the length of its rows. The
    function says what is computed, and stays what it is wherever numba does not translate.
    """

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        class Template(AbstractTemplate):
            key = function

            def generic(self, args: Any, kws: Any) -> Any:
                return signature(returns, *(types.unliteral(kind) for kind in args))

        def lower(context: Any, builder: Any, sign: Any, values: Any) -> Any:
            given: list[Any] = []
            for kind, value in zip(sign.args, values, strict=True):
                if isinstance(kind, types.Array):
                    model: Any = context.data_model_manager[kind]
                    given.append(model.get(builder, value, "data"))
                    if kind.ndim > 1:
                        shape = model.get(builder, value, "shape")
                        given.append(cgutils.unpack_tuple(builder, shape, kind.ndim)[1])
                else:
                    wanted = types.intp if isinstance(kind, types.Integer) else types.float64
                    given.append(context.cast(builder, value, kind, wanted))
            result = emit(builder, *given)
            return context.get_dummy_value() if result is None else result

        infer_global(function, types.Function(Template))
        lower_builtin(function, *[types.Any] * function.__code__.co_argcount)(lower)
        return function

    return register


def emit_dot(builder: Any, x: Any, y: Any, first: Any, end: Any) -> Any:
    """Emit Σ x y from first to end."""

    def body(k: Any, total: Any) -> list[Any]:
        return [multiply_add(builder, load(builder, x, k), load(builder, y, k), total)]

    (total,) = loop(builder, first, end, LANES, body, [zeros(VECTOR)])
    pairs = _halves(builder, _halves(builder, total, LANES), FOUR)
    return builder.fadd(*(builder.extract_element(pairs, LANE(i)) for i in range(2)))


def emit_dots(
    builder: Any, x: Any, A: Any, columns: Any, count: Any, into: Any, width: Any
) -> None:
    """Emit into[b] ← Σ x A[b] for so many rows of A, of which ``width`` numbers count; zeros behind."""
    zero = INDEX(0)

    def four(b: Any) -> list[Any]:
        starts = [builder.mul(builder.add(b, INDEX(i)), columns) for i in range(FOUR)]

        def body(c: Any, *totals: Any) -> list[Any]:
            factor = load(builder, x, c)
            rows = [load(builder, A, builder.add(start, c)) for start in starts]
            return [
                multiply_add(builder, factor, row, total)
                for row, total in zip(rows, totals, strict=True)
            ]

        totals = loop(builder, zero, width, LANES, body, [zeros(VECTOR)] * FOUR)
        store(builder, _four_sums(builder, totals), into, b)
        return []

    def rest(b: Any, sums: Any) -> list[Any]:
        row = builder.gep(A, [builder.mul(b, columns)])
        one = emit_dot(builder, x, row, zero, width)
        here = compared(builder, FOUR, "==", builder.sub(b, by_four))
        return [builder.select(here, spread(builder, one, FOUR), sums)]

    by_four = builder.and_(count, INDEX(-FOUR))
    loop(builder, zero, by_four, FOUR, four)
    with builder.if_then(builder.icmp_signed("<", by_four, count)):
        (sums,) = loop(builder, by_four, count, 1, rest, [zeros(ir.VectorType(DOUBLE, FOUR))])
        store(builder, sums, into, by_four)
    end = builder.and_(builder.add(count, INDEX(FOUR - 1)), INDEX(-FOUR))
    with builder.if_then(builder.icmp_signed("!=", builder.and_(end, INDEX(FOUR)), zero)):
        store(builder, zeros(ir.VectorType(DOUBLE, FOUR)), into, end)


def emit_add(builder: Any, factor: Any, x: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← into + factor · x from first to end."""
    many = spread(builder, factor)
    _change(
        builder, into, first, end,
        lambda k, now: multiply_add(builder, many, load(builder, x, k), now),
    )  # fmt: skip


def emit_combine(
    builder: Any, factors: Any, A: Any, columns: Any,
    first: Any, end: Any, into: Any, begin: Any, width: Any,
) -> None:  # fmt: skip
    """Emit into ← into + Σ factors[k] A[k] over rows first to end, of numbers begin to width."""
    value = _combination(builder, factors, INDEX(1), A, columns, first, end)
    _change(builder, into, begin, width, value)


def emit_combined(
    builder: Any, factors: Any, A: Any, columns: Any, first: Any, end: Any, into: Any, width: Any
) -> None:
    """Emit into ← Σ factors[k] A[k] over rows first to end, of which ``width`` numbers count."""
    value = _combination(builder, factors, INDEX(1), A, columns, first, end)
    _write(builder, into, INDEX(0), width, lambda c: value(c, zeros(VECTOR)))


def emit_combine_by_column(
    builder: Any, F: Any, step: Any, column: Any, A: Any, columns: Any,
    first: Any, end: Any, into: Any, begin: Any, width: Any,
) -> None:  # fmt: skip
    """Emit into ← into + Σ F[k, column] A[k] over rows first to end, of numbers begin to width."""
    value = _combination(builder, builder.gep(F, [column]), step, A, columns, first, end)
    _change(builder, into, begin, width, value)


def _combination(
    builder: Any, factors: Any, step: Any, A: Any, columns: Any, first: Any, end: Any
) -> Callable[[Any, Any], Any]:
    """Return what adds Σ factors[k step] A[k] over rows first to end to a vector from number c on."""

    def column(c: Any, now: Any) -> Any:
        def row(k: Any, total: Any) -> list[Any]:
            factor = builder.load(builder.gep(factors, [builder.mul(k, step)]))
            part = load(builder, A, builder.add(builder.mul(k, columns), c))
            return [multiply_add(builder, spread(builder, factor), part, total)]

        (total,) = loop(builder, first, end, 1, row, [now])
        return total

    return column


def emit_add_sizes(builder: Any, x: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← into + |x| from first to end."""
    _change(
        builder, into, first, end,
        lambda k, now: builder.fadd(now, each(builder, "fabs", load(builder, x, k))),
    )  # fmt: skip


def emit_put(builder: Any, factor: Any, x: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← factor · x from first to end."""
    many = spread(builder, factor)
    _write(builder, into, first, end, lambda k: builder.fmul(many, load(builder, x, k)))


def emit_copy(builder: Any, x: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← x from first to end."""
    _write(builder, into, first, end, lambda k: load(builder, x, k))


def emit_fill(builder: Any, value: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← value from first to end."""
    many = spread(builder, value)
    _write(builder, into, first, end, lambda k: many)


def emit_put_unit(builder: Any, value: Any, place: Any, into: Any, width: Any) -> None:
    """Emit into ← value at one place, zeros elsewhere."""
    many = spread(builder, value)
    _write(
        builder, into, INDEX(0), width,
        lambda k: kept(builder, many, "==", builder.sub(place, k)),
    )  # fmt: skip


def emit_put_at(builder: Any, value: Any, place: Any, into: Any) -> None:
    """Emit into[place] ← value in the vector that holds it: nobody waits for a part of it then."""
    start = builder.and_(place, INDEX(-LANES))
    here = compared(builder, LANES, "==", builder.sub(place, start))
    store(
        builder,
        builder.select(here, spread(builder, value), load(builder, into, start)),
        into,
        start,
    )


def emit_clear_after(builder: Any, x: Any, count: Any, end: Any) -> None:
    """Emit zeros from number ``count`` of x to end."""
    start = builder.and_(count, INDEX(-LANES))
    _change(builder, x, start, end, lambda k, now: kept(builder, now, "<", builder.sub(count, k)))


def emit_clear_before(builder: Any, x: Any, count: Any) -> None:
    """Emit zeros before number ``count`` of x, from the start of its vector."""
    start = builder.and_(count, INDEX(-LANES))
    store(
        builder, kept(builder, load(builder, x, start), ">=", builder.sub(count, start)), x, start
    )


def emit_take_first(builder: Any, x: Any, into: Any, count: Any) -> None:
    """Emit into ← x of so many numbers; of ``into`` no more is written."""

    def body(k: Any) -> list[Any]:
        store_first(builder, load(builder, x, k), into, k, builder.sub(count, k))
        return []

    loop(builder, INDEX(0), count, LANES, body)


def emit_put_products(builder: Any, x: Any, y: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← x y, number by number, from first to end."""
    _write(
        builder, into, first, end,
        lambda k: builder.fmul(load(builder, x, k), load(builder, y, k)),
    )  # fmt: skip


def emit_put_first(builder: Any, factor: Any, x: Any, into: Any, count: Any) -> None:
    """Emit into ← factor · x of so many numbers, zeros behind; of x no more is read."""
    many = spread(builder, factor)
    _write(
        builder, into, INDEX(0), count,
        lambda k: builder.fmul(many, load_first(builder, x, k, builder.sub(count, k))),
    )  # fmt: skip


def _change(builder: Any, into: Any, first: Any, end: Any, value: Callable[..., Any]) -> None:
    _write(builder, into, first, end, lambda k: value(k, load(builder, into, k)))


def _write(builder: Any, into: Any, first: Any, end: Any, value: Callable[..., Any]) -> None:
    def body(k: Any) -> list[Any]:
        store(builder, value(k), into, k)
        return []

    loop(builder, first, end, LANES, body)


def _halves(builder: Any, x: Any, count: int) -> Any:
    """Add the two halves of so many numbers."""
    half = count // 2
    low, high = lanes_of(range(half)), lanes_of(range(half, count))
    return builder.fadd(builder.shuffle_vector(x, x, low), builder.shuffle_vector(x, x, high))


def _four_sums(builder: Any, vectors: Sequence[Any]) -> Any:
    """Add up each of four vectors: neighbours first, so that two vectors take one addition."""

    def crossed(x: Any, y: Any, left: Sequence[int], right: Sequence[int]) -> Any:
        parts = (builder.shuffle_vector(x, y, lanes_of(lanes)) for lanes in (left, right))
        return builder.fadd(*parts)

    a, b, c, d = (_halves(builder, x, LANES) for x in vectors)
    one, other = (crossed(x, y, (0, 4, 2, 6), (1, 5, 3, 7)) for x, y in ((a, b), (c, d)))
    return crossed(one, other, (0, 1, 4, 5), (2, 3, 6, 7))
