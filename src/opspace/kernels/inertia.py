"""The inertia as U Uᵀ, with zeros where a tree has them, and what that makes of motions and torques.

Eliminated from the tips to the base, the inertia of a tree fills nothing in (Featherstone 2005): row a
of Uᵀ has entries only at the coordinates that carry a. In whitened coordinates, û = U⁻¹ Γ and
Ĵ = J U⁻ᵀ, rows of different branches have different columns.
"""

from __future__ import annotations

import math

from opspace.kernels.whole_vectors import (
    clear_after,
    combine,
    combine_by_column,
    combined,
    dots,
    fill,
    put,
    put_first,
    put_unit,
    take_first,
    whole,
)
from opspace.machine.jit import jit


@jit
def factor(M, inertia):
    """Factor M = U Uᵀ, (n, n) kg·m², from the tips to the base, and find U⁻ᵀ.

    Returns:
        Whether M is positive definite; otherwise U is not usable.
    """
    L, n = inertia.L, inertia.L.shape[0]
    for a in range(n - 1, -1, -1):
        if not _eliminate(M, a, inertia):
            return False
    for a in range(n):  # by themselves, since the next row would wait for each root
        put(1.0 / math.sqrt(L[a, a]), L[a], L[a], 0, whole(a + 1))
        clear_after(L[a], a + 1, whole(a + 1))
    _invert(inertia)
    return True


@jit
def _eliminate(M, a, inertia):
    """Take from row a of M, into L, what all that a carries does of it; and divide by what is left at a.

    Returns:
        Whether that is above zero.
    """
    L, scaled, size = inertia.L, inertia.white, whole(a + 1)
    put_first(1.0, M[a], L[a], a + 1)
    combine_by_column(L, a, scaled, a + 1, inertia.end[a], L[a], 0, size)
    left = L[a, a]
    put(-1.0 / left, L[a], scaled[a], 0, size)
    return left > 0.0


@jit
def _invert(inertia):
    """Find U⁻ᵀ row by row from the base: what row a of Uᵀ makes of it is e_a."""
    L, white = inertia.L, inertia.white
    for a in range(L.shape[0]):
        row = white[a]
        put_unit(-1.0, a, row, whole(L.shape[0]))
        _combine_chain(L[a], white, inertia, inertia.before[a], row)
        put(-1.0 / L[a, a], row, row, 0, whole(a + 1))


@jit
def _combine_chain(factors, A, inertia, last, into):
    """Add Σ factors[k] A[k] to ``into`` over all k from ``last`` to the base; A is lower triangular."""
    start, before = inertia.start, inertia.before
    while last >= 0:
        first = start[last]
        combine(factors, A, first, last + 1, into, 0, whole(last + 1))
        last = before[first]


@jit
def whiten_rows(inertia, last, first, end, J, X):
    """Fill rows ``first`` to ``end`` − 1 of X (rows, n) with J U⁻ᵀ, J of a frame behind ``last``."""
    white = inertia.white
    width = whole(white.shape[0])
    for i in range(first, end):
        if last < 0:
            fill(0.0, X[i], 0, width)
        else:
            start = inertia.start[last]
            combined(J[i], white, start, last + 1, X[i], width)
            _combine_chain(J[i], white, inertia, inertia.before[start], X[i])


@jit
def whiten_row(inertia, x, out):
    """Fill a padded row out (n,) with x U⁻ᵀ, for any row x (n,) of a Jacobian."""
    n = inertia.white.shape[0]
    combined(x, inertia.white, 0, n, out, whole(n))


@jit
def whiten(inertia, x):
    """Overwrite any row x (n,) of a Jacobian with x U⁻ᵀ, and a torque [N·m] with U⁻¹ x [√J/s]."""
    whiten_row(inertia, x, inertia.spare)
    take_first(inertia.spare, x, inertia.white.shape[0])


@jit
def unit_row(inertia, a, weight, x):
    """Fill x (n,) with the whitened row of a joint: weight · e_aᵀ U⁻ᵀ."""
    for b in range(inertia.white.shape[0]):
        x[b] = weight * inertia.white[a, b]


@jit
def acceleration_of(inertia, x):
    """Overwrite a whitened torque (n,) [√J/s] with the acceleration U⁻ᵀ x [rad/s²] that it causes."""
    _times(inertia.white, x, x, inertia)


@jit
def whitened_of(inertia, x, out):
    """Fill out (n,) with the whitened torque Uᵀ x [√J/s] of an acceleration [rad/s²]."""
    _times(inertia.L, x, out, inertia)


@jit
def _times(A, x, out, inertia):
    """Fill out (n,) with A x."""
    n = A.shape[0]
    put_first(1.0, x, inertia.spare, n)
    dots(inertia.spare, A, n, inertia.product, whole(n))
    take_first(inertia.product, out, n)


@jit
def torque_of(inertia, x, out):
    """Fill out (n,) with the torque U x [N·m] of a whitened one [√J/s]."""
    n = inertia.L.shape[0]
    combined(x, inertia.L, 0, n, inertia.spare, whole(n))
    take_first(inertia.spare, out, n)


@jit
def joint_row(inertia, j, out):
    """Fill out (n,) with row j of U: what a unit of each whitened torque gives joint j [N·m]."""
    for a in range(inertia.L.shape[0]):
        out[a] = inertia.L[a, j]
