"""Sine and cosine of whole vectors of angles, without a call for each, whatever libm there is.

An angle is taken to within π/4 of a multiple of π/2, which is subtracted in three parts (Cody and
Waite 1980): the product with each is exact. There both are the polynomials of fdlibm (Sun Microsystems
1993), off by less than the last digit. What is farther than `FAR` goes to the functions of libm.
"""

# numba's own modules have no type stubs.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from llvmlite import ir

from opspace.machine.lanes import LANES
from opspace.machine.vector_code import INDEX, VECTOR, each, kept, load_first, loop, store

FAR = 1e6
"""Largest angle, rad, whose multiple of π/2 is exact in each part."""

PARTS = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624871116645580e-21)
"""Parts of π/2 of 33 bits each."""

TO_WHOLE = 1.5 * 2.0**52
"""Added to a number and taken off again it leaves the next whole one; its last bits are that one's."""

SINE = (
    *(-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04),
    *(2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10),
)
COSINE = (
    *(4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05),
    *(-2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11),
)

WORDS = ir.VectorType(INDEX, LANES)

ORDERED = ("contract",)
"""Sums here may be fused with products, but must not change their order."""


def emit_turn(builder: Any, angles: Any, cosine: Any, sine: Any, count: Any) -> None:
    """Emit cosine ← cos angles, sine ← sin angles of so many angles, rad; zeros behind."""

    def body(k: Any) -> list[Any]:
        left = builder.sub(count, k)
        x = load_first(builder, angles, k, left)
        c, s = _turn(builder, x)
        store(builder, kept(builder, c, "<", left), cosine, k)
        store(builder, s, sine, k)
        far = builder.fcmp_ordered(">", each(builder, "fabs", x), _same(FAR))
        some = builder.bitcast(far, ir.IntType(LANES))
        with builder.if_then(builder.icmp_unsigned("!=", some, some.type(0)), likely=False):
            store(builder, kept(builder, each(builder, "cos", x), "<", left), cosine, k)
            store(builder, each(builder, "sin", x), sine, k)
        return []

    loop(builder, INDEX(0), count, LANES, body)


def _turn(builder: Any, x: Any) -> tuple[Any, Any]:
    """Cosine and sine of angles that are not far."""
    shifted = _multiply_add(builder, x, _same(2.0 / math.pi), _same(TO_WHOLE))
    quarters = builder.fsub(shifted, _same(TO_WHOLE), flags=ORDERED)
    r = x
    for part in PARTS:
        r = _multiply_add(builder, quarters, _same(-part), r)
    square = builder.fmul(r, r, flags=ORDERED)
    cubic = builder.fmul(r, square, flags=ORDERED)
    s = _multiply_add(builder, cubic, _polynomial(builder, square, SINE), r)
    c = _cosine(builder, square)
    bits = builder.bitcast(shifted, WORDS)
    odd = builder.icmp_unsigned("!=", builder.and_(bits, _same(1)), _same(0))
    return (
        _turned(builder, builder.select(odd, s, c), builder.add(bits, _same(1))),
        _turned(builder, builder.select(odd, c, s), bits),
    )


def _cosine(builder: Any, square: Any) -> Any:
    """1 − z/2 + z² C(z), with what the first difference is off by."""
    half = builder.fmul(square, _same(0.5), flags=ORDERED)
    most = builder.fsub(_same(1.0), half, flags=ORDERED)
    off = builder.fsub(builder.fsub(_same(1.0), most, flags=ORDERED), half, flags=ORDERED)
    fourth = builder.fmul(square, square, flags=ORDERED)
    rest = _multiply_add(builder, fourth, _polynomial(builder, square, COSINE), off)
    return builder.fadd(most, rest, flags=ORDERED)


def _polynomial(builder: Any, x: Any, factors: Sequence[float]) -> Any:
    total = _same(factors[-1])
    for factor in reversed(factors[:-1]):
        total = _multiply_add(builder, x, total, _same(factor))
    return total


def _turned(builder: Any, x: Any, quarters: Any) -> Any:
    """Change signs where the second bit of a number of quarter turns is set."""
    sign = builder.shl(builder.and_(quarters, _same(2)), _same(62))
    return builder.bitcast(builder.xor(builder.bitcast(x, WORDS), sign), VECTOR)


def _multiply_add(builder: Any, x: Any, y: Any, total: Any) -> Any:
    return builder.fadd(builder.fmul(x, y, flags=ORDERED), total, flags=ORDERED)


def _same(value: float) -> Any:
    kind = WORDS if isinstance(value, int) else VECTOR
    return ir.Constant(kind, [value] * LANES)
