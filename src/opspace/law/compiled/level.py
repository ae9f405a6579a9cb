"""One level of the hierarchy, with its weak directions fading out (Section 4.1)."""

from __future__ import annotations

import math

from opspace.law.compiled.algebra import (
    apply_reflectors,
    apply_reflectors_transposed,
    cholesky,
    gram,
    householder,
    singular_values,
    solve_upper,
    solve_upper_transposed,
)
from opspace.law.compiled.jit import jit
from opspace.law.compiled.profiles import profile
from opspace.law.hierarchy import RANK_TOLERANCE

REGULAR = 1e-6
"""Without a buffer, a level whose smallest σ is above this fraction of ‖J‖² has full rank."""


@jit
def solve_level(d, count, n, J, f, last, buffer, s):
    """Solve the rows ``s.rows[:count]`` below what depth ``d`` has decided.

    û_l = û_{l−1} + (Ĵ_l N_{l−1})⁺ (f_l − Ĵ_l û_{l−1}), for every alternative i: the i strongest
    directions of JN JNᵀ = U Σ Uᵀ (Eq. 25), with weight h(σ_i) − h(σ_{i+1}).

    Args:
        d: Depth of the levels above in the arrays of ``s``.
        count: Number of rows m.
        n: Number of joints.
        J: Whitened rows of every task set.
        f: Their desired values.
        last: Whether nothing is below, so that what is left free does not matter.
        buffer: (on, lower, upper, profile); without ``on`` only exact dependence is removed.
        s: The memory.

    Returns:
        Number of alternatives; 1 stands for a result that is already at depth d + 1.
    """
    r = s.free[d]
    _project(d, count, n, r, J, f, s)
    bound = _bound(count, n, J, buffer, s.rows)
    if r < count:
        if _solve_tall(d, count, n, r, bound, s):
            return 1
        _singular_tall(count, r, s)
        rank = r
    else:
        if _solve_wide(d, count, n, r, last, bound, s):
            return 1
        _singular_wide(count, s)
        rank = count
    threshold = 0.0
    if buffer[0] == 0.0:
        threshold = RANK_TOLERANCE * _largest(count, n, J, s)
    return _alternatives(d, count, n, r, rank, threshold, buffer, s)


@jit
def _project(d, count, n, r, J, f, s):
    """B = Ĵ Z and the residual f − Ĵ û."""
    Z, u, B, rows, residual = s.Z, s.u, s.B, s.rows, s.residual
    for i in range(count):
        row = rows[i]
        done = 0.0
        for a in range(n):
            done += J[row, a] * u[d, a]
        residual[i] = f[row] - done
        for b in range(r):
            x = 0.0
            for a in range(n):
                x += J[row, a] * Z[d, b, a]
            B[i, b] = x


@jit
def _bound(count, n, J, buffer, rows):
    """What all eigenvalues must exceed for a level to be solved without its spectrum."""
    if buffer[0] != 0.0:
        return buffer[2]
    # Before projection: a level of which nothing is left is rounding noise, however regular.
    size = 0.0
    for i in range(count):
        for a in range(n):
            size += J[rows[i], a] * J[rows[i], a]
    return REGULAR * size


@jit
def _solve_wide(d, m, n, r, last, bound, s):
    """Rows that are all active: x = Q R⁻ᵀ residual; what is left free is the rest of Q."""
    B, G, R, x, scale, residual = s.B, s.G, s.R, s.x, s.scale, s.residual
    gram(B, m, r, G)
    regular = cholesky(G, m, bound, s.Y)
    householder(B, m, r, scale, R)
    if not regular:
        return False
    for i in range(m):
        x[i] = residual[i]
    solve_upper_transposed(R, m, x)
    s.free[d + 1] = r - m
    if not last and r - m > m:
        _turn_basis(d, m, n, r, s)
        return True
    for i in range(m, r):
        x[i] = 0.0
    apply_reflectors(B, m, r, scale, x)
    _step(d, n, r, s.Z[d], x, s.u)
    if not last:
        for j in range(m, r):
            _complement(m, n, r, j, B, scale, x, s.Z[d], s.Z[d + 1, j - m])
    return True


@jit
def _turn_basis(d, m, n, r, s):
    """Step along the first m vectors of the basis turned by Qᵀ; the others are what is left free.

    The same as column by column, and cheaper where many columns are left.
    """
    turned, Z = s.V[d], s.Z[d + 1]
    _turn(m, n, r, s.B, s.scale, s.Z[d], turned, s.y)
    _step(d, n, m, turned, s.x, s.u)
    for j in range(m, r):
        for a in range(n):
            Z[j - m, a] = turned[j, a]


@jit
def _turn(m, n, r, B, scale, Z, turned, w):
    """Qᵀ Z: the basis turned so that its first m vectors are those that the rows use."""
    for b in range(r):
        for a in range(n):
            turned[b, a] = Z[b, a]
    for k in range(m):
        for a in range(n):
            w[a] = 0.0
        for b in range(k, r):
            factor = B[k, b]
            for a in range(n):
                w[a] += factor * turned[b, a]
        for b in range(k, r):
            factor = scale[k] * B[k, b]
            for a in range(n):
                turned[b, a] -= factor * w[a]


@jit
def _solve_tall(d, m, n, r, bound, s):
    """More rows than free motions, all of them used: least squares, nothing is left free."""
    B, C, G, R, x, scale, residual = s.B, s.C, s.G, s.R, s.x, s.scale, s.residual
    for b in range(r):
        for i in range(m):
            C[b, i] = B[i, b]
    gram(C, r, m, G)
    if not cholesky(G, r, bound, s.Y):
        return False
    householder(C, r, m, scale, R)
    for i in range(m):
        x[i] = residual[i]
    apply_reflectors_transposed(C, r, m, scale, x)
    solve_upper(R, r, x)
    _step(d, n, r, s.Z[d], x, s.u)
    s.free[d + 1] = 0
    return True


@jit
def _step(d, n, count, vectors, x, u):
    """û_l = û_{l−1} + Σ x_b vectors_b."""
    for a in range(n):
        u[d + 1, a] = u[d, a]
    for b in range(count):
        factor = x[b]
        for a in range(n):
            u[d + 1, a] += factor * vectors[b, a]


@jit
def _complement(m, n, r, j, B, scale, x, Z, vector):
    """Column j of Q, in joint coordinates."""
    for b in range(r):
        x[b] = 0.0
    x[j] = 1.0
    apply_reflectors(B, m, r, scale, x)
    for a in range(n):
        vector[a] = 0.0
    for b in range(r):
        factor = x[b]
        for a in range(n):
            vector[a] += factor * Z[b, a]


@jit
def _singular_wide(m, s):
    """Singular values of Rᵀ, hence of the level; C gets σ_i u_i as rows."""
    C, R = s.C, s.R
    for i in range(m):
        for j in range(m):
            C[i, j] = R[i, j] if j >= i else 0.0
    singular_values(C, m, m, s.Y, s.sigma)


@jit
def _singular_tall(m, r, s):
    B, C = s.B, s.C
    for b in range(r):
        for i in range(m):
            C[b, i] = B[i, b]
    singular_values(C, r, m, s.Y, s.sigma)


@jit
def _largest(count, n, J, s):
    """‖J‖₂ of the rows before projection, by power iteration on J Jᵀ."""
    x, y, rows, z = s.x, s.y, s.rows, s.G[0]
    for i in range(count):
        y[i] = 1.0 + 0.1 * i
    norm = 0.0
    # Only the order of magnitude counts: the threshold is far from any singular value that matters.
    for _ in range(20):
        for a in range(n):
            total = 0.0
            for i in range(count):
                total += J[rows[i], a] * y[i]
            z[a] = total
        norm = 0.0
        for i in range(count):
            total = 0.0
            for a in range(n):
                total += J[rows[i], a] * z[a]
            x[i] = total
            norm += total * total
        norm = math.sqrt(norm)
        if norm == 0.0:
            return 0.0
        for i in range(count):
            y[i] = x[i] / norm
    return math.sqrt(norm)


@jit
def _alternatives(d, m, n, r, rank, threshold, buffer, s):
    """Directions, what each adds, and the weights of the chain; the i strongest are alternative i."""
    _directions(d, m, n, r, rank, s)
    sigma, strength, share, C, residual = s.sigma, s.strength, s.share, s.C, s.residual
    before = 1.0
    faded = 0
    for i in range(rank):
        h = 0.0
        if buffer[0] != 0.0:
            h = profile(int(buffer[3]), (sigma[i] * sigma[i] - buffer[1]) / (buffer[2] - buffer[1]))
        elif sigma[i] > threshold:
            h = 1.0
        strength[d, i] = 0.0
        if h > 0.0:
            total = 0.0
            for a in range(m):
                total += C[i, a] * residual[a]
            strength[d, i] = total / (sigma[i] * sigma[i])
        if h < 1.0:
            faded = 1
        share[d, i] = before - h
        before = h
    share[d, rank] = before
    s.faded[0] = faded
    return rank + 1


@jit
def _directions(d, m, n, r, rank, s):
    """V: right singular vectors in joint coordinates, then an orthonormal basis of the rest."""
    B, Y, Z, V, x, scale = s.B, s.Y, s.Z, s.V, s.x, s.scale
    wide = m <= r
    for i in range(rank):
        for b in range(r):
            x[b] = Y[i, b] if b < rank else 0.0
        if wide:
            apply_reflectors(B, m, r, scale, x)
        for a in range(n):
            V[d, i, a] = 0.0
        for b in range(r):
            factor = x[b]
            for a in range(n):
                V[d, i, a] += factor * Z[d, b, a]
    for j in range(rank, r):
        _complement(m, n, r, j, B, scale, x, Z[d], V[d, j])


@jit
def take_alternative(d, i, n, s):
    """Put the alternative with the ``i`` strongest directions at depth d + 1."""
    u, V, Z, strength = s.u, s.V, s.Z, s.strength
    for a in range(n):
        total = u[d, a]
        for k in range(i):
            total += strength[d, k] * V[d, k, a]
        u[d + 1, a] = total
    left = s.free[d] - i
    s.free[d + 1] = left
    for k in range(left):
        for a in range(n):
            Z[d + 1, k, a] = V[d, i + k, a]
