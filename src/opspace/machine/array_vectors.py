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

DOUBLE, INDEX, LANE = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
VECTOR = ir.VectorType(DOUBLE, LANES)
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
        return [_multiply_add(builder, _load(builder, x, k), _load(builder, y, k), total)]

    (total,) = _loop(builder, first, end, LANES, body, [_zeros(VECTOR)])
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
            factor = _load(builder, x, c)
            rows = [_load(builder, A, builder.add(start, c)) for start in starts]
            return [
                _multiply_add(builder, factor, row, total)
                for row, total in zip(rows, totals, strict=True)
            ]

        totals = _loop(builder, zero, width, LANES, body, [_zeros(VECTOR)] * FOUR)
        _store(builder, _four_sums(builder, totals), into, b)
        return []

    def rest(b: Any, sums: Any) -> list[Any]:
        row = builder.gep(A, [builder.mul(b, columns)])
        one = emit_dot(builder, x, row, zero, width)
        here = _compared(builder, FOUR, "==", builder.sub(b, by_four))
        return [builder.select(here, _all(builder, one, FOUR), sums)]

    by_four = builder.and_(count, INDEX(-FOUR))
    _loop(builder, zero, by_four, FOUR, four)
    with builder.if_then(builder.icmp_signed("<", by_four, count)):
        (sums,) = _loop(builder, by_four, count, 1, rest, [_zeros(ir.VectorType(DOUBLE, FOUR))])
        _store(builder, sums, into, by_four)
    end = builder.and_(builder.add(count, INDEX(FOUR - 1)), INDEX(-FOUR))
    with builder.if_then(builder.icmp_signed("!=", builder.and_(end, INDEX(FOUR)), zero)):
        _store(builder, _zeros(ir.VectorType(DOUBLE, FOUR)), into, end)


def emit_add(builder: Any, factor: Any, x: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← into + factor · x from first to end."""
    many = _all(builder, factor)
    _change(
        builder, into, first, end,
        lambda k, now: _multiply_add(builder, many, _load(builder, x, k), now),
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
    _write(builder, into, INDEX(0), width, lambda c: value(c, _zeros(VECTOR)))


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
            part = _load(builder, A, builder.add(builder.mul(k, columns), c))
            return [_multiply_add(builder, _all(builder, factor), part, total)]

        (total,) = _loop(builder, first, end, 1, row, [now])
        return total

    return column


def emit_add_sizes(builder: Any, x: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← into + |x| from first to end."""
    kind = ir.FunctionType(VECTOR, [VECTOR])
    size = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fabs.v{LANES}f64")
    _change(
        builder, into, first, end,
        lambda k, now: builder.fadd(now, builder.call(size, [_load(builder, x, k)])),
    )  # fmt: skip


def emit_put(builder: Any, factor: Any, x: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← factor · x from first to end."""
    many = _all(builder, factor)
    _write(builder, into, first, end, lambda k: builder.fmul(many, _load(builder, x, k)))


def emit_copy(builder: Any, x: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← x from first to end."""
    _write(builder, into, first, end, lambda k: _load(builder, x, k))


def emit_fill(builder: Any, value: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← value from first to end."""
    many = _all(builder, value)
    _write(builder, into, first, end, lambda k: many)


def emit_put_unit(builder: Any, value: Any, place: Any, into: Any, width: Any) -> None:
    """Emit into ← value at one place, zeros elsewhere."""
    many = _all(builder, value)
    _write(
        builder, into, INDEX(0), width,
        lambda k: _kept(builder, many, "==", builder.sub(place, k)),
    )  # fmt: skip


def emit_put_at(builder: Any, value: Any, place: Any, into: Any) -> None:
    """Emit into[place] ← value in the vector that holds it: nobody waits for a part of it then."""
    start = builder.and_(place, INDEX(-LANES))
    here = _compared(builder, LANES, "==", builder.sub(place, start))
    _store(
        builder,
        builder.select(here, _all(builder, value), _load(builder, into, start)),
        into,
        start,
    )


def emit_clear_after(builder: Any, x: Any, count: Any, end: Any) -> None:
    """Emit zeros from number ``count`` of x to end."""
    start = builder.and_(count, INDEX(-LANES))
    _change(builder, x, start, end, lambda k, now: _kept(builder, now, "<", builder.sub(count, k)))


def emit_clear_before(builder: Any, x: Any, count: Any) -> None:
    """Emit zeros before number ``count`` of x, from the start of its vector."""
    start = builder.and_(count, INDEX(-LANES))
    _store(
        builder, _kept(builder, _load(builder, x, start), ">=", builder.sub(count, start)), x, start
    )


def emit_take_first(builder: Any, x: Any, into: Any, count: Any) -> None:
    """Emit into ← x of so many numbers; of ``into`` no more is written."""
    kind = ir.VectorType(ir.IntType(1), LANES)
    asked = ir.FunctionType(ir.VoidType(), [VECTOR, VECTOR.as_pointer(), LANE, kind])
    name = f"llvm.masked.store.v{LANES}f64.p0v{LANES}f64"
    store = cgutils.get_or_insert_function(builder.module, asked, name)

    def body(k: Any) -> list[Any]:
        place = builder.bitcast(builder.gep(into, [k]), VECTOR.as_pointer())
        there = _compared(builder, LANES, "<", builder.sub(count, k))
        builder.call(store, [_load(builder, x, k), place, LANE(8), there])
        return []

    _loop(builder, INDEX(0), count, LANES, body)


def emit_put_products(builder: Any, x: Any, y: Any, into: Any, first: Any, end: Any) -> None:
    """Emit into ← x y, number by number, from first to end."""
    _write(
        builder, into, first, end,
        lambda k: builder.fmul(_load(builder, x, k), _load(builder, y, k)),
    )  # fmt: skip


def emit_put_first(builder: Any, factor: Any, x: Any, into: Any, count: Any) -> None:
    """Emit into ← factor · x of so many numbers, zeros behind; of x no more is read."""
    kind = ir.VectorType(ir.IntType(1), LANES)
    asked = ir.FunctionType(VECTOR, [VECTOR.as_pointer(), LANE, kind, VECTOR])
    name = f"llvm.masked.load.v{LANES}f64.p0v{LANES}f64"
    load = cgutils.get_or_insert_function(builder.module, asked, name)
    many = _all(builder, factor)

    def value(k: Any) -> Any:
        place = builder.bitcast(builder.gep(x, [k]), VECTOR.as_pointer())
        there = _compared(builder, LANES, "<", builder.sub(count, k))
        found = builder.call(load, [place, LANE(8), there, _zeros(VECTOR)])
        return builder.fmul(many, found)

    _write(builder, into, INDEX(0), count, value)


def _kept(builder: Any, x: Any, which: str, count: Any) -> Any:
    """Replace numbers by zero but those whose place compares so with a count."""
    keep = _compared(builder, x.type.count, which, count)
    return builder.select(keep, x, _zeros(x.type))


def _compared(builder: Any, lanes: int, which: str, count: Any) -> Any:
    places = ir.Constant(ir.VectorType(INDEX, lanes), [INDEX(i) for i in range(lanes)])
    return builder.icmp_signed(which, places, _all(builder, count, lanes))


def _change(builder: Any, into: Any, first: Any, end: Any, value: Callable[..., Any]) -> None:
    _write(builder, into, first, end, lambda k: value(k, _load(builder, into, k)))


def _write(builder: Any, into: Any, first: Any, end: Any, value: Callable[..., Any]) -> None:
    def body(k: Any) -> list[Any]:
        _store(builder, value(k), into, k)
        return []

    _loop(builder, first, end, LANES, body)


def _loop(
    builder: Any, first: Any, end: Any, step: int, body: Callable[..., list[Any]],
    start: Sequence[Any] = (),
) -> list[Any]:  # fmt: skip
    """Emit a loop from first to end, and return what it hands on.

    By the names of its blocks `opspace.machine.translate` finds it, so that it is not unrolled.
    """
    before = builder.block
    loop, after = builder.append_basic_block("vectors"), builder.append_basic_block("after")
    builder.cbranch(builder.icmp_signed("<", first, end), loop, after)
    builder.position_at_end(loop)
    k = builder.phi(INDEX)
    k.add_incoming(first, before)
    handed = [builder.phi(value.type) for value in start]
    for phi, value in zip(handed, start, strict=True):
        phi.add_incoming(value, before)
    results = body(k, *handed)
    following, last = builder.add(k, INDEX(step), flags=["nsw"]), builder.block
    for phi, value in zip([k, *handed], [following, *results], strict=True):
        phi.add_incoming(value, last)
    builder.cbranch(builder.icmp_signed(">=", following, end), after, loop)
    builder.position_at_end(after)
    found = [builder.phi(value.type) for value in start]
    for phi, value, result in zip(found, start, results, strict=True):
        phi.add_incoming(value, before)
        phi.add_incoming(result, last)
    return found


def _load(builder: Any, array: Any, k: Any) -> Any:
    place = builder.bitcast(builder.gep(array, [k]), VECTOR.as_pointer())
    return builder.load(place, align=8)


def _store(builder: Any, value: Any, array: Any, k: Any) -> None:
    place = builder.bitcast(builder.gep(array, [k]), value.type.as_pointer())
    builder.store(value, place, align=8)


def _multiply_add(builder: Any, x: Any, y: Any, total: Any) -> Any:
    return builder.fadd(total, builder.fmul(x, y))


def _zeros(kind: Any) -> Any:
    return ir.Constant(kind, [0.0] * kind.count)


def _all(builder: Any, value: Any, lanes: int = LANES) -> Any:
    kind = ir.VectorType(value.type, lanes)
    nothing = ir.Constant(kind, ir.Undefined)
    one = builder.insert_element(nothing, value, LANE(0))
    return builder.shuffle_vector(one, nothing, _lanes([0] * lanes))


def _lanes(numbers: Sequence[int]) -> Any:
    return ir.Constant(ir.VectorType(LANE, len(numbers)), list(numbers))


def _halves(builder: Any, x: Any, count: int) -> Any:
    """Add the two halves of so many numbers."""
    half = count // 2
    low, high = _lanes(range(half)), _lanes(range(half, count))
    return builder.fadd(builder.shuffle_vector(x, x, low), builder.shuffle_vector(x, x, high))


def _four_sums(builder: Any, vectors: Sequence[Any]) -> Any:
    """Add up each of four vectors: neighbours first, so that two vectors take one addition."""

    def crossed(x: Any, y: Any, left: Sequence[int], right: Sequence[int]) -> Any:
        parts = (builder.shuffle_vector(x, y, _lanes(lanes)) for lanes in (left, right))
        return builder.fadd(*parts)

    a, b, c, d = (_halves(builder, x, LANES) for x in vectors)
    one, other = (crossed(x, y, (0, 4, 2, 6), (1, 5, 3, 7)) for x, y in ((a, b), (c, d)))
    return crossed(one, other, (0, 1, 4, 5), (2, 3, 6, 7))
