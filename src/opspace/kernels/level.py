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
from opspace.kernels.compiled_scalars import fade
from opspace.law.scalars import RANK_TOLERANCE
from opspace.machine.jit import jit

REGULAR = 1e-6
"""Without a buffer, a level whose smallest σ is above this fraction of ‖J‖² has full rank."""


NORMAL = 1e-4
"""Normal equations lose the digits of the condition number twice: above this fraction of ‖B‖² they
lose four."""


@jit
def project(d, count, n, J, f, space):
    """Put the rows ``space.rows[:count]`` before depth ``d``: B = Ĵ Z and the residual f − Ĵ û.

    Args:
        d: Depth of the levels above in the arrays of ``space``.
        count: Number of rows m.
        n: Number of joints.
        J: (rows, n) whitened rows of every task set.
        f: (rows,) their desired values, √J/s.
        space: `SPACE`; Z, u, free are read, B (count, free) and residual (count,) written.
    """
    Z, u, B, rows, residual = space.Z[d], space.u[d], space.B, space.rows, space.residual
    r = space.free[d]
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
def solve_level(d, count, n, J, last, buffer, space):
    """Solve the rows that `project` has put before what depth ``d`` has decided.

    û_l = û_{l−1} + (Ĵ_l N_{l−1})⁺ (f_l − Ĵ_l û_{l−1}), for every alternative i: the i strongest
    directions of JN JNᵀ = U Σ Uᵀ (Eq. 25), each as far as it responds, with weight
    h(σ_i) − h(σ_{i+1}).

    Args:
        d: Depth of the levels above in the arrays of ``space``.
        count: Number of rows m.
        n: Number of joints.
        J: (rows, n) whitened rows of every task set.
        last: Whether nothing is below, so that what is left free does not matter.
        buffer: (on, lower, upper, profile, upper edge of the release, damping, then lower edge, that of
            the release and upper edge at rest), see `opspace.law.SigmaBuffer`; without ``on`` only
            exact dependence is removed.
        space: `SPACE`; B and residual are read, u, Z, free of depth d + 1 written, or for a level
            that branches V, strength, share.

    Returns:
        Number of alternatives; 1 stands for a result that is already at depth d + 1.
    """
    r = space.free[d]
    bound = _bound(count, n, J, buffer, space.rows)
    used = _use_columns(count, r, space)
    if r <= count:
        if _solve_tall(d, count, n, r, bound, space):
            return 1
        _singular_tall(count, r, space)
        rank = r
    else:
        if count == 1 and _solve_row(d, n, used, last, bound, space):
            return 1
        if _solve_wide(d, count, n, used, last, bound, space):
            return 1
        _singular_wide(count, space)
        rank = count
    threshold = 0.0
    if buffer[0] == 0.0:
        threshold = RANK_TOLERANCE * _largest(count, n, J, space)
    return _alternatives(d, count, n, used, rank, threshold, buffer, space)


@jit
def _use_columns(m, r, space):
    """Leave out the free motions that no row moves, where enough are left: columns of zeros in B.

    Returns:
        How many are left; ``space.column`` lists them, then the others.
    """
    B, column, size = space.B, space.column, space.x
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
def _solve_row(d, n, used, last, bound, space):
    """One row: a step along it; the others are turned by the reflector that makes it the first."""
    row, column, Z, left, along = space.B[0], space.column, space.Z[d], space.Z[d + 1], space.y
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
    factor = space.residual[0] / size
    for a in range(n):
        space.u[d + 1, a] = space.u[d, a] + factor * along[a]
    r = space.free[d]
    space.free[d + 1] = r - 1
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
def _solve_wide(d, m, n, used, last, bound, space):
    """Rows that are all active: x = Q R⁻ᵀ residual; what is left free is the rest of Q."""
    B, R, x, scale, residual = space.B, space.R, space.x, space.scale, space.residual
    householder(B, m, used, scale, R)
    if not _regular(R, m, bound, space):
        return False
    for i in range(m):
        x[i] = residual[i]
    solve_upper_transposed(R, m, x)
    r = space.free[d]
    space.free[d + 1] = r - m
    if used < r or (not last and r - m > m):
        _turn_basis(d, m, n, used, r, space)
        return True
    for i in range(m, r):
        x[i] = 0.0
    apply_reflectors(B, m, r, scale, x)
    if r == n:  # the basis is the identity
        for a in range(n):
            space.u[d + 1, a] = space.u[d, a] + x[a]
    else:
        _step(n, r, space.Z[d], x, space.u[d], space.u[d + 1])
    if not last:
        for j in range(m, r):
            _complement(d, m, n, r, j, x, space, space.Z[d + 1, j - m])
    return True


@jit
def _regular(R, m, bound, space):
    """Whether all eigenvalues of RᵀR are above a bound."""
    G = space.G
    for i in range(m):
        for j in range(i + 1):
            G[i, j] = 0.0
    for k in range(m):
        for i in range(k, m):
            factor = R[k, i]
            for j in range(k, i + 1):
                G[i, j] += factor * R[k, j]
    return cholesky(G, m, bound, space.Y)


@jit
def _turn_basis(d, m, n, used, r, space):
    """Step along the first m vectors of the basis turned by Qᵀ; the others are what is left free.

    The same as column by column, and cheaper where many are left.
    """
    turned, column, Z, left = space.V[d], space.column, space.Z[d], space.Z[d + 1]
    for c in range(used):
        _copy(n, Z[column[c]], turned[c])
    _turn(m, n, used, space.B, space.scale, turned, space.y)
    _step(n, m, turned, space.x, space.u[d], space.u[d + 1])
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
def _solve_tall(d, m, n, r, bound, space):
    """At least as many rows as free motions, all of them used: least squares, nothing is left free."""
    B, C, x, residual = space.B, space.C, space.x, space.residual
    size = 0.0
    for b in range(r):
        for i in range(m):
            C[b, i] = B[i, b]
            size += C[b, i] * C[b, i]
    enough = NORMAL * size
    if not _solve_normal(m, r, max(bound, enough), space):
        if bound >= enough:
            return False
        householder(C, r, m, space.scale, space.R)
        if not _regular(space.R, r, bound, space):
            return False
        for i in range(m):
            x[i] = residual[i]
        apply_reflectors_transposed(C, r, m, space.scale, x)
        solve_upper(space.R, r, x)
    _step(n, r, space.Z[d], x, space.u[d], space.u[d + 1])
    space.free[d + 1] = 0
    return True


@jit
def _solve_normal(m, r, bound, space):
    """Solve BᵀB x = Bᵀ residual, at a third of the cost of an orthogonal factorisation.

    Returns:
        Whether all eigenvalues of BᵀB are above the bound; otherwise there is no x.
    """
    C, G, L, x, residual = space.C, space.G, space.R, space.x, space.residual
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
def _complement(d, m, n, used, j, x, space, vector):
    """Column j of Q, in joint coordinates."""
    for b in range(used):
        x[b] = 0.0
    x[j] = 1.0
    apply_reflectors(space.B, m, used, space.scale, x)
    _combine(n, used, space.free[d], space.Z[d], space.column, x, vector)


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
def _singular_wide(m, space):
    """Singular values of Rᵀ, hence of the level; C gets σ_i u_i as rows."""
    C, R = space.C, space.R
    for i in range(m):
        for j in range(m):
            C[i, j] = R[i, j] if j >= i else 0.0
    singular_values(C, m, m, space.Y, space.sigma)


@jit
def _singular_tall(m, r, space):
    B, C = space.B, space.C
    for b in range(r):
        for i in range(m):
            C[b, i] = B[i, b]
    singular_values(C, r, m, space.Y, space.sigma)


@jit
def _largest(count, n, J, space):
    """‖J‖₂ of the rows before projection, by power iteration on J Jᵀ."""
    x, y, rows, z = space.x, space.y, space.rows, space.G[0]
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
def _alternatives(d, m, n, used, rank, threshold, buffer, space):
    """Directions, what each adds, and the weights of the chain; the i strongest are alternative i."""
    _directions(d, m, n, used, rank, space)
    sigma, strength, share, C, residual = (
        space.sigma,
        space.strength,
        space.share,
        space.C,
        space.residual,
    )
    before, unrest = 1.0, 0.0
    for i in range(m):
        unrest += space.unrest[space.rows[i]]
    unrest = math.sqrt(unrest)
    faded = 0
    for i in range(rank):
        h, response = 0.0, 1.0
        if buffer[0] != 0.0:
            code, square = int(buffer[3]), sigma[i] * sigma[i]
            response = fade(code, square, buffer[1], buffer[2], buffer[6], buffer[8], unrest)
            h = fade(code, square, buffer[1], buffer[4], buffer[6], buffer[7], unrest)
        elif sigma[i] > threshold:
            h = 1.0
        strength[d, i] = 0.0
        if h > 0.0:
            total = 0.0
            for a in range(m):
                total += C[i, a] * residual[a]
            strength[d, i] = response / h * total / (sigma[i] * sigma[i])
            if response < 1.0 and buffer[5] > 0.0:
                along = 0.0
                for a in range(n):
                    along += space.V[d, i, a] * space.motion[a]
                strength[d, i] -= (1.0 - response) * buffer[5] * along
        if h < 1.0:
            faded = 1
        share[d, i] = before - h
        before = h
    share[d, rank] = before
    space.faded[0] = faded
    return rank + 1


@jit
def _directions(d, m, n, used, rank, space):
    """V: right singular vectors in joint coordinates, then an orthonormal basis of the rest."""
    B, Y, Z, V, x, scale, column = (
        space.B,
        space.Y,
        space.Z[d],
        space.V[d],
        space.x,
        space.scale,
        space.column,
    )
    r = space.free[d]
    for i in range(rank):
        for b in range(used):
            x[b] = Y[i, b] if b < rank else 0.0
        if m < r:
            apply_reflectors(B, m, used, scale, x)
        _combine(n, used, r, Z, column, x, V[i])
    for j in range(rank, used):
        _complement(d, m, n, used, j, x, space, V[j])
    for j in range(used, r):
        _copy(n, Z[column[j]], V[j])


@jit
def take_alternative(d, i, n, space):
    """Put the alternative with the ``i`` strongest directions at depth d + 1."""
    V, strength, before, after, left = (
        space.V[d],
        space.strength[d],
        space.u[d],
        space.u[d + 1],
        space.Z[d + 1],
    )
    r = space.free[d]
    space.free[d + 1] = r - i
    if i == 0:
        V = space.Z[d]  # as it was, so that the identity stays one
    for a in range(n):
        total = before[a]
        for k in range(i):
            total += strength[k] * V[k, a]
        after[a] = total
    for k in range(i, r):
        _copy(n, V[k], left[k - i])
