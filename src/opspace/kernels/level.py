"""One level of the hierarchy, with its weak directions fading out (Section 4.1)."""

from __future__ import annotations

import math

from opspace.kernels.algebra import (
    apply_reflectors,
    apply_reflectors_transposed,
    cholesky,
    householder,
    singular_values,
    solve_lower,
    solve_lower_transposed,
    solve_upper,
    solve_upper_transposed,
)
from opspace.kernels.scalars import profile
from opspace.law.scalars import RANK_TOLERANCE
from opspace.machine.jit import jit

REGULAR = 1e-6
"""Without a buffer, a level whose smallest σ is above this fraction of ‖J‖² has full rank."""


NORMAL = 1e-4
"""Normal equations lose the digits of the condition number twice: above this fraction of ‖B‖² they
lose four."""


@jit
def project(d, count, n, J, f, s):
    """Put the rows ``s.rows[:count]`` before depth ``d``: B = Ĵ Z and the residual f − Ĵ û.

    Args:
        d: Depth of the levels above in the arrays of ``s``.
        count: Number of rows m.
        n: Number of joints.
        J: Whitened rows of every task set.
        f: Their desired values.
        s: The memory.
    """
    Z, u, B, rows, residual = s.Z[d], s.u[d], s.B, s.rows, s.residual
    r = s.free[d]
    for i in range(count):
        row, into = J[rows[i]], B[i]
        done = 0.0
        for a in range(n):
            done += row[a] * u[a]
        residual[i] = f[rows[i]] - done
        if r == n:  # nothing is used yet, and Z is the identity
            for b in range(n):
                into[b] = row[b]
            continue
        for b in range(r):
            x = 0.0
            for a in range(n):
                x += row[a] * Z[b, a]
            into[b] = x


@jit
def solve_level(d, count, n, J, last, buffer, s):
    """Solve the rows that `project` has put before what depth ``d`` has decided.

    û_l = û_{l−1} + (Ĵ_l N_{l−1})⁺ (f_l − Ĵ_l û_{l−1}), for every alternative i: the i strongest
    directions of JN JNᵀ = U Σ Uᵀ (Eq. 25), with weight h(σ_i) − h(σ_{i+1}).

    Args:
        d: Depth of the levels above in the arrays of ``s``.
        count: Number of rows m.
        n: Number of joints.
        J: Whitened rows of every task set.
        last: Whether nothing is below, so that what is left free does not matter.
        buffer: (on, lower, upper, profile); without ``on`` only exact dependence is removed.
        s: The memory.

    Returns:
        Number of alternatives; 1 stands for a result that is already at depth d + 1.
    """
    r = s.free[d]
    bound = _bound(count, n, J, buffer, s.rows)
    used = _use_columns(count, r, s)
    if r <= count:
        if _solve_tall(d, count, n, r, bound, s):
            return 1
        _singular_tall(count, r, s)
        rank = r
    else:
        if count == 1 and _solve_row(d, n, used, last, bound, s):
            return 1
        if _solve_wide(d, count, n, used, last, bound, s):
            return 1
        _singular_wide(count, s)
        rank = count
    threshold = 0.0
    if buffer[0] == 0.0:
        threshold = RANK_TOLERANCE * _largest(count, n, J, s)
    return _alternatives(d, count, n, used, rank, threshold, buffer, s)


@jit
def _use_columns(m, r, s):
    """Leave out the free motions that no row moves, where enough are left: columns of zeros in B.

    Returns:
        How many are left; ``s.column`` lists them, then the others.
    """
    B, column, size = s.B, s.column, s.x
    for b in range(r):
        size[b] = 0.0
    for i in range(m):
        for b in range(r):
            size[b] += abs(B[i, b])
    used = 0
    for b in range(r):
        if size[b] != 0.0:
            column[used] = b
            used += 1
    if used == r or used < m:
        for b in range(r):
            column[b] = b
        return r
    for i in range(m):
        for c in range(used):
            B[i, c] = B[i, column[c]]
    others = used
    for b in range(r):
        if size[b] == 0.0:
            column[others] = b
            others += 1
    return used


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
def _solve_row(d, n, used, last, bound, s):
    """One row: a step along it; the others are turned by the reflector that makes it the first."""
    row, column, Z, left, along = s.B[0], s.column, s.Z[d], s.Z[d + 1], s.y
    size = 0.0
    for c in range(used):
        size += row[c] * row[c]
    if not size > bound:
        return False
    for a in range(n):
        along[a] = 0.0
    for c in range(used):
        factor, vector = row[c], Z[column[c]]
        for a in range(n):
            along[a] += factor * vector[a]
    factor = s.residual[0] / size
    for a in range(n):
        s.u[d + 1, a] = s.u[d, a] + factor * along[a]
    r = s.free[d]
    s.free[d + 1] = r - 1
    if last:
        return True
    norm = math.sqrt(size)
    first, pivot = Z[column[0]], row[0]
    alpha = -norm if pivot > 0.0 else norm
    scale = 1.0 / (norm * (norm + abs(pivot)))
    for a in range(n):
        along[a] = scale * (along[a] - alpha * first[a])
    for c in range(1, used):
        factor, vector, turned = row[c], Z[column[c]], left[c - 1]
        for a in range(n):
            turned[a] = vector[a] - factor * along[a]
    for c in range(used, r):
        _copy(n, Z[column[c]], left[c - 1])
    return True


@jit
def _solve_wide(d, m, n, used, last, bound, s):
    """Rows that are all active: x = Q R⁻ᵀ residual; what is left free is the rest of Q."""
    B, R, x, scale, residual = s.B, s.R, s.x, s.scale, s.residual
    householder(B, m, used, scale, R)
    if not _regular(R, m, bound, s):
        return False
    for i in range(m):
        x[i] = residual[i]
    solve_upper_transposed(R, m, x)
    r = s.free[d]
    s.free[d + 1] = r - m
    if used < r or (not last and r - m > m):
        _turn_basis(d, m, n, used, r, s)
        return True
    for i in range(m, r):
        x[i] = 0.0
    apply_reflectors(B, m, r, scale, x)
    if r == n:  # the basis is the identity
        for a in range(n):
            s.u[d + 1, a] = s.u[d, a] + x[a]
    else:
        _step(n, r, s.Z[d], x, s.u[d], s.u[d + 1])
    if not last:
        for j in range(m, r):
            _complement(d, m, n, r, j, x, s, s.Z[d + 1, j - m])
    return True


@jit
def _regular(R, m, bound, s):
    """Whether all eigenvalues of RᵀR are above a bound."""
    G = s.G
    for i in range(m):
        for j in range(i + 1):
            G[i, j] = 0.0
    for k in range(m):
        for i in range(k, m):
            factor = R[k, i]
            for j in range(k, i + 1):
                G[i, j] += factor * R[k, j]
    return cholesky(G, m, bound, s.Y)


@jit
def _turn_basis(d, m, n, used, r, s):
    """Step along the first m vectors of the basis turned by Qᵀ; the others are what is left free.

    The same as column by column, and cheaper where many are left.
    """
    turned, column, Z, left = s.V[d], s.column, s.Z[d], s.Z[d + 1]
    for c in range(used):
        _copy(n, Z[column[c]], turned[c])
    _turn(m, n, used, s.B, s.scale, turned, s.y)
    _step(n, m, turned, s.x, s.u[d], s.u[d + 1])
    for c in range(m, used):
        _copy(n, turned[c], left[c - m])
    for c in range(used, r):
        _copy(n, Z[column[c]], left[c - m])


@jit
def _copy(n, x, into):
    for a in range(n):
        into[a] = x[a]


@jit
def _turn(m, n, r, B, scale, turned, w):
    """Turn a basis so that its first m vectors are those that the rows use."""
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
    """At least as many rows as free motions, all of them used: least squares, nothing is left free."""
    B, C, x, residual = s.B, s.C, s.x, s.residual
    size = 0.0
    for b in range(r):
        for i in range(m):
            C[b, i] = B[i, b]
            size += C[b, i] * C[b, i]
    enough = NORMAL * size
    if not _solve_normal(m, r, max(bound, enough), s):
        if bound >= enough:
            return False
        householder(C, r, m, s.scale, s.R)
        if not _regular(s.R, r, bound, s):
            return False
        for i in range(m):
            x[i] = residual[i]
        apply_reflectors_transposed(C, r, m, s.scale, x)
        solve_upper(s.R, r, x)
    _step(n, r, s.Z[d], x, s.u[d], s.u[d + 1])
    s.free[d + 1] = 0
    return True


@jit
def _solve_normal(m, r, bound, s):
    """Solve BᵀB x = Bᵀ residual, at a third of the cost of an orthogonal factorisation.

    Returns:
        Whether all eigenvalues of BᵀB are above the bound; otherwise there is no x.
    """
    C, G, L, x, residual = s.C, s.G, s.R, s.x, s.residual
    for a in range(r):
        for b in range(a + 1):
            total = 0.0
            for i in range(m):
                total += C[a, i] * C[b, i]
            G[a, b] = total
    if not cholesky(G, r, bound, L):
        return False
    cholesky(G, r, 0.0, L)
    for a in range(r):
        total = 0.0
        for i in range(m):
            total += C[a, i] * residual[i]
        x[a] = total
    solve_lower(L, r, x)
    solve_lower_transposed(L, r, x)
    return True


@jit
def _step(n, count, vectors, x, before, after):
    """û_l = û_{l−1} + Σ x_b vectors_b."""
    for a in range(n):
        after[a] = before[a]
    for b in range(count):
        factor = x[b]
        for a in range(n):
            after[a] += factor * vectors[b, a]


@jit
def _complement(d, m, n, used, j, x, s, vector):
    """Column j of Q, in joint coordinates."""
    for b in range(used):
        x[b] = 0.0
    x[j] = 1.0
    apply_reflectors(s.B, m, used, s.scale, x)
    _combine(n, used, s.free[d], s.Z[d], s.column, x, vector)


@jit
def _combine(n, used, r, Z, column, x, vector):
    """Σ x_c times the vectors of Z that are used, of r in all."""
    for a in range(n):
        vector[a] = 0.0
    if r == n:  # the basis is the identity
        for c in range(used):
            vector[column[c]] = x[c]
        return
    for c in range(used):
        factor, basis = x[c], Z[column[c]]
        for a in range(n):
            vector[a] += factor * basis[a]


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
def _alternatives(d, m, n, used, rank, threshold, buffer, s):
    """Directions, what each adds, and the weights of the chain; the i strongest are alternative i."""
    _directions(d, m, n, used, rank, s)
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
def _directions(d, m, n, used, rank, s):
    """V: right singular vectors in joint coordinates, then an orthonormal basis of the rest."""
    B, Y, Z, V, x, scale, column = s.B, s.Y, s.Z[d], s.V[d], s.x, s.scale, s.column
    r = s.free[d]
    for i in range(rank):
        for b in range(used):
            x[b] = Y[i, b] if b < rank else 0.0
        if m < r:
            apply_reflectors(B, m, used, scale, x)
        _combine(n, used, r, Z, column, x, V[i])
    for j in range(rank, used):
        _complement(d, m, n, used, j, x, s, V[j])
    for j in range(used, r):
        _copy(n, Z[column[j]], V[j])


@jit
def take_alternative(d, i, n, s):
    """Put the alternative with the ``i`` strongest directions at depth d + 1."""
    V, strength, before, after, left = s.V[d], s.strength[d], s.u[d], s.u[d + 1], s.Z[d + 1]
    r = s.free[d]
    s.free[d + 1] = r - i
    if i == 0:
        V = s.Z[d]  # as it was, so that the identity stays one
    for a in range(n):
        total = before[a]
        for k in range(i):
            total += strength[k] * V[k, a]
        after[a] = total
    for k in range(i, r):
        _copy(n, V[k], left[k - i])
