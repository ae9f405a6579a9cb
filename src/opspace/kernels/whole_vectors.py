"""Loops over rows that are padded with zeros to whole vectors of numbers.

Rows are as long in memory as `whole` says; so are what is written and what is read of them: ``first``
and ``begin`` come from `whole_before`, ``end`` and ``width`` from `whole`.
"""

from __future__ import annotations

from numba import types

from opspace.machine.array_vectors import (
    emit_add,
    emit_add_sizes,
    emit_clear_after,
    emit_clear_before,
    emit_combine,
    emit_combine_by_column,
    emit_combined,
    emit_copy,
    emit_dot,
    emit_dots,
    emit_fill,
    emit_put,
    emit_put_at,
    emit_put_first,
    emit_put_products,
    emit_put_unit,
    emit_take_first,
    in_vectors,
)
from opspace.machine.jit import jit
from opspace.machine.lanes import whole as whole_of
from opspace.machine.lanes import whole_before as whole_before_of

whole = jit(whole_of)
whole_before = jit(whole_before_of)


@in_vectors(emit_dot, types.float64)
def dot(x, y, first, end):
    """Σ x y from first to end."""
    total = 0.0
    for k in range(first, end):
        total += x[k] * y[k]
    return total


@in_vectors(emit_dots, types.void)
def dots(x, A, count, into, width):
    """into[b] ← Σ x A[b] for so many rows of A, of which ``width`` numbers count; zeros behind."""
    clear_after(into, count, whole(count))
    for b in range(count):
        total = 0.0
        for c in range(width):
            total += x[c] * A[b, c]
        into[b] = total


@in_vectors(emit_add, types.void)
def add(factor, x, into, first, end):
    """Into ← into + factor · x from first to end."""
    for k in range(first, end):
        into[k] += factor * x[k]


@in_vectors(emit_combine, types.void)
def combine(factors, A, first, end, into, begin, width):
    """Into ← into + Σ factors[k] A[k] over the rows first to end, from number begin to width."""
    for k in range(first, end):
        for c in range(begin, width):
            into[c] += factors[k] * A[k, c]


@in_vectors(emit_combined, types.void)
def combined(factors, A, first, end, into, width):
    """Into ← Σ factors[k] A[k] over the rows first to end, of which ``width`` numbers count."""
    for c in range(width):
        into[c] = 0.0
    for k in range(first, end):
        for c in range(width):
            into[c] += factors[k] * A[k, c]


@in_vectors(emit_combine_by_column, types.void)
def combine_by_column(A, column, first, end, into, begin, width):
    """Into ← into + Σ A[k, column] A[k] over the rows first to end, from number begin to width."""
    for k in range(first, end):
        for c in range(begin, width):
            into[c] += A[k, column] * A[k, c]


@in_vectors(emit_put, types.void)
def put(factor, x, into, first, end):
    """Into ← factor · x from first to end."""
    for k in range(first, end):
        into[k] = factor * x[k]


@in_vectors(emit_add_sizes, types.void)
def add_sizes(x, into, first, end):
    """Into ← into + |x| from first to end."""
    for k in range(first, end):
        into[k] += abs(x[k])


@in_vectors(emit_copy, types.void)
def copy(x, into, first, end):
    """Into ← x from first to end."""
    for k in range(first, end):
        into[k] = x[k]


@in_vectors(emit_fill, types.void)
def fill(value, into, first, end):
    """Into ← value from first to end."""
    for k in range(first, end):
        into[k] = value


@in_vectors(emit_put_first, types.void)
def put_first(factor, x, into, count):
    """Into ← factor · x of so many numbers, zeros behind; x itself need not be padded."""
    clear_after(into, count, whole(count))
    for k in range(count):
        into[k] = factor * x[k]


@in_vectors(emit_take_first, types.void)
def take_first(x, into, count):
    """Into ← x of so many numbers; ``into`` itself need not be padded."""
    for k in range(count):
        into[k] = x[k]


@in_vectors(emit_put_products, types.void)
def put_products(x, y, into, first, end):
    """Into ← x y, number by number, from first to end."""
    for k in range(first, end):
        into[k] = x[k] * y[k]


@in_vectors(emit_put_unit, types.void)
def put_unit(value, place, into, width):
    """Into ← value at one place, zeros elsewhere."""
    for k in range(width):
        into[k] = 0.0
    into[place] = value


@in_vectors(emit_put_at, types.void)
def put_at(value, place, into):
    """into[place] ← value, where the vectors around it are used at once."""
    into[place] = value


@in_vectors(emit_clear_after, types.void)
def clear_after(x, count, end):
    """Zeros from number ``count`` of x to end."""
    for k in range(count, end):
        x[k] = 0.0


@in_vectors(emit_clear_before, types.void)
def clear_before(x, count):
    """Zeros before number ``count`` of x, from where its vector begins."""
    for k in range(whole_before(count), count):
        x[k] = 0.0
