"""The inertia as U Uᵀ, with zeros where a tree has them.

Eliminated from the tips to the base, the inertia of a tree fills nothing in (Featherstone 2005): row a
of U has entries only at the coordinates that a carries, which are neighbours. In whitened
coordinates, û = U⁻¹ Γ and Ĵ = J U⁻ᵀ, rows of different branches have different columns.
"""

from __future__ import annotations

import math

from opspace.machine.jit import jit


@jit
def factor(M, inertia):
    """Factor M = U Uᵀ, (n, n) kg·m², from the tips to the base.

    Returns:
        Whether M is positive definite; otherwise U is not usable.
    """
    U, inverse, before, end = inertia.U, inertia.inverse, inertia.before, inertia.end
    for a in range(U.shape[0] - 1, -1, -1):
        s = M[a, a]
        for k in range(a + 1, end[a]):
            s -= U[a, k] * U[a, k]
        if not s > 0.0:
            return False
        U[a, a] = math.sqrt(s)
        scale = 1.0 / U[a, a]
        inverse[a] = scale
        b = before[a]
        while b >= 0:
            s = M[b, a]
            for k in range(a + 1, end[a]):
                s -= U[a, k] * U[b, k]
            U[b, a] = s * scale
            b = before[b]
    return True


@jit
def whiten_rows(inertia, last, first, end, X):
    """Overwrite rows ``first`` to ``end`` − 1 of X (rows, n), of a frame behind ``last``, with X U⁻ᵀ."""
    U, inverse, before = inertia.U, inertia.inverse, inertia.before
    a = last
    while a >= 0:
        # Row by row inside, so that one need not wait for the other.
        for i in range(first, end):
            s = X[i, a]
            for k in range(a + 1, last + 1):
                s -= U[a, k] * X[i, k]
            X[i, a] = s * inverse[a]
        a = before[a]


@jit
def whiten(inertia, x):
    """Overwrite any row x (n,) of a Jacobian with x U⁻ᵀ, and a torque [N·m] with U⁻¹ x [√J/s]."""
    U, inverse, end = inertia.U, inertia.inverse, inertia.end
    for a in range(U.shape[0] - 1, -1, -1):
        s = x[a]
        for k in range(a + 1, end[a]):
            s -= U[a, k] * x[k]
        x[a] = s * inverse[a]


@jit
def unit_row(inertia, a, weight, x):
    """Fill x (n,) with the whitened row of a joint: weight · e_aᵀ U⁻ᵀ."""
    U, inverse, before = inertia.U, inertia.inverse, inertia.before
    for b in range(x.shape[0]):
        x[b] = 0.0
    x[a] = weight * inverse[a]
    b = before[a]
    while b >= 0:
        s = 0.0
        for k in range(b + 1, a + 1):
            s -= U[b, k] * x[k]
        x[b] = s * inverse[b]
        b = before[b]


@jit
def acceleration_of(inertia, x):
    """Overwrite a whitened torque (n,) [√J/s] with the acceleration U⁻ᵀ x [rad/s²] that it causes."""
    U, inverse, end = inertia.U, inertia.inverse, inertia.end
    for a in range(U.shape[0]):
        x[a] *= inverse[a]
        for k in range(a + 1, end[a]):
            x[k] -= U[a, k] * x[a]


@jit
def whitened_of(inertia, x, out):
    """Fill out (n,) with the whitened torque Uᵀ x [√J/s] of an acceleration [rad/s²]."""
    U, end = inertia.U, inertia.end
    for a in range(U.shape[0]):
        out[a] = 0.0
    for a in range(U.shape[0]):
        for k in range(a, end[a]):
            out[k] += U[a, k] * x[a]


@jit
def torque_of(inertia, x, out):
    """Fill out (n,) with the torque U x [N·m] of a whitened one [√J/s]."""
    U, end = inertia.U, inertia.end
    for a in range(U.shape[0]):
        s = 0.0
        for k in range(a, end[a]):
            s += U[a, k] * x[k]
        out[a] = s
