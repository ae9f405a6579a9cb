"""Loops over rows that are padded with zeros to whole vectors of numbers.

Rows are as long in memory as `whole` says; so are what is written and what is read of them: ``first``
and ``begin`` come from `whole_before`, ``end`` and ``width`` from `whole`.
"""

from __future__ import annotations

import math

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
from opspace.machine.sine_vectors import emit_turn

whole = jit(whole_of)
whole_before = jit(whole_before_of)


@in_vectors(emit_dot, types.float64)
def dot(x, y, first, end):
    """Return Σ x y from first to end."""
    total = 0.0
    for k in range(first, end):
        total += x[k] * y[k]
    return total


@in_vectors(emit_dots, types.void)
def dots(x, A, count, into, width):
    """Fill so many numbers of ``into`` with Σ x A[b] over ``width`` numbers; zeros behind."""
    clear_after(into, count, whole(count))
    for b in range(count):
        total = 0.0
        for c in range(width):
            total += x[c] * A[b, c]
        into[b] = total


@in_vectors(emit_add, types.void)
def add(factor, x, into, first, end):
    """Add factor · x to ``into`` from first to end."""
    for k in range(first, end):
        into[k] += factor * x[k]


@in_vectors(emit_combine, types.void)
def combine(factors, A, first, end, into, begin, width):
    """Add Σ factors[k] A[k] over the rows first to end to ``into``, from number begin to width."""
    for c in range(begin, width):
        total = into[c]
        for k in range(first, end):
            total += factors[k] * A[k, c]
        into[c] = total


@in_vectors(emit_combined, types.void)
def combined(factors, A, first, end, into, width):
    """Fill ``into`` with Σ factors[k] A[k] over the rows first to end, ``width`` numbers of each."""
    for c in range(width):
        total = 0.0
        for k in range(first, end):
            total += factors[k] * A[k, c]
        into[c] = total


@in_vectors(emit_combine_by_column, types.void)
def combine_by_column(F, column, A, first, end, into, begin, width):
    """Add Σ F[k, column] A[k] over the rows first to end to ``into``, from number begin to width."""
    for c in range(begin, width):
        total = into[c]
        for k in range(first, end):
            total += F[k, column] * A[k, c]
        into[c] = total


@in_vectors(emit_put, types.void)
def put(factor, x, into, first, end):
    """Fill ``into`` with factor · x from first to end."""
    for k in range(first, end):
        into[k] = factor * x[k]


@in_vectors(emit_add_sizes, types.void)
def add_sizes(x, into, first, end):
    """Add |x| to ``into`` from first to end."""
    for k in range(first, end):
        into[k] += abs(x[k])


@in_vectors(emit_copy, types.void)
def copy(x, into, first, end):
    """Fill ``into`` with x from first to end."""
    for k in range(first, end):
        into[k] = x[k]


@in_vectors(emit_fill, types.void)
def fill(value, into, first, end):
    """Fill ``into`` with a value from first to end."""
    for k in range(first, end):
        into[k] = value


@in_vectors(emit_put_first, types.void)
def put_first(factor, x, into, count):
    """Fill so many numbers of ``into`` with factor · x, zeros behind; x itself need not be padded."""
    clear_after(into, count, whole(count))
    for k in range(count):
        into[k] = factor * x[k]


@in_vectors(emit_take_first, types.void)
def take_first(x, into, count):
    """Fill so many numbers of ``into`` with x; ``into`` itself need not be padded."""
    for k in range(count):
        into[k] = x[k]


@in_vectors(emit_put_products, types.void)
def put_products(x, y, into, first, end):
    """Fill ``into`` with x y, number by number, from first to end."""
    for k in range(first, end):
        into[k] = x[k] * y[k]


@in_vectors(emit_put_unit, types.void)
def put_unit(value, place, into, width):
    """Fill ``into`` with a value at one place and zeros elsewhere."""
    for k in range(width):
        into[k] = 0.0
    into[place] = value


@in_vectors(emit_put_at, types.void)
def put_at(value, place, into):
    """Put a value at one place of ``into``, where the vectors around it are used at once."""
    into[place] = value


@in_vectors(emit_clear_after, types.void)
def clear_after(x, count, end):
    """Fill x with zeros from number ``count`` to end."""
    for k in range(count, end):
        x[k] = 0.0


@in_vectors(emit_clear_before, types.void)
def clear_before(x, count):
    """Fill x with zeros before number ``count``, from where its vector begins."""
    for k in range(whole_before(count), count):
        x[k] = 0.0


@in_vectors(emit_turn, types.void)
def turn(angles, cosine, sine, count):
    """Fill cosine and sine with those of so many angles, rad, zeros behind.

    The angles themselves need not be padded.
    """
    clear_after(cosine, count, whole(count))
    clear_after(sine, count, whole(count))
    for k in range(count):
        cosine[k] = math.cos(angles[k])
        sine[k] = math.sin(angles[k])
